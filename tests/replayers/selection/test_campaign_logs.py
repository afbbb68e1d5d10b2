"""What counts in a selection: trials that were driven, and candidates that ran over each of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from shutil import copy

import msgspec
import pytest

import replayers
from replayers.batch.next_look import SharedLook
from replayers.batch.replays import LogFailed, Replays
from replayers.batch.store import StoredReplay
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.selection.campaign_logs import GroupBy, trial_groups
from replayers.selection.next_look import look_lines, looks_of_trials
from replayers.selection.verdict import SelectionSettings, verdict_after
from workbench.cli import run as lios

LOGS = Path(__file__).resolve().parents[3] / "logs"
FINDS = [LOGS / f"find-{name}.mcap" for name in ("greedy", "lios")]
NAMES = ("opt-greedy", "model-lios")
RAISES = """
from workbench.planning.strategies import strategy


class One:
    name = "one"

    def relevant_types(self, task):
        return strategy("model-lios").relevant_types(task)

    def decide(self, view):
        raise RuntimeError("no idea")


class Two(One):
    name = "two"
"""


@pytest.fixture(scope="module")
def finds() -> Replays:
    return replayers.replay(FINDS, NAMES, settings=ReplaySettings(worlds=5))


def as_broken(record: StoredReplay, name: str, reason: str = "no idea") -> StoredReplay:
    """A replay of a candidate that broke."""
    return msgspec.structs.replace(
        record, strategy=name, status="planner-failed", reason=reason, bounds=None, estimate=None, drawn=()
    )


def with_more(finds: Replays, *more: StoredReplay | LogFailed) -> Replays:
    return replace(finds, outcomes=(*finds.outcomes, *more))


def test_a_candidate_that_breaks_does_not_change_what_is_said_of_the_others(finds: Replays) -> None:
    (alone,) = trial_groups(finds, NAMES, GroupBy.SCENARIO).groups
    first, second = (next(r for r in finds if r.log == str(log)) for log in FINDS)
    everywhere = with_more(finds, as_broken(first, "one"), as_broken(second, "one", "still none"))
    once = with_more(finds, as_broken(first, "one"), msgspec.structs.replace(second, strategy="one"))
    for made, logs in ((everywhere, 2), (once, 1)):
        (group,) = trial_groups(made, (*NAMES, "one"), GroupBy.SCENARIO).groups
        assert group.broke == {"one": (tuple(log.name for log in FINDS[:logs]), "no idea")}
        assert verdict_after(group.trials, SelectionSettings()) == verdict_after(alone.trials, SelectionSettings())


def test_a_candidate_that_could_not_be_replayed_is_named_once_and_the_logs_count(finds: Replays) -> None:
    reason = "estimator 'raises@1': it raised"
    made = with_more(finds, *(LogFailed(log=str(log), strategy="x by raises", reason=reason) for log in FINDS))
    found = trial_groups(made, NAMES, GroupBy.SCENARIO)
    assert (dict(found.not_replayed), found.left_out) == ({"x by raises": reason}, ())
    assert [len(group.trials) for group in found.groups] == [2]


def test_one_that_could_not_be_replayed_over_one_log_is_out_with_the_reason(finds: Replays) -> None:
    second = next(r for r in finds if r.log == str(FINDS[1]))
    made = with_more(
        finds,
        LogFailed(log=str(FINDS[0]), strategy="m:One", reason="it needs an answer"),  # "one" by the user's name
        msgspec.structs.replace(second, strategy="one"),
    )
    found = trial_groups(made, (*NAMES, "one"), GroupBy.SCENARIO)
    assert found.groups[0].broke == {"one": (("find-greedy.mcap",), "it needs an answer")}
    assert not found.not_replayed


def test_a_log_on_which_all_break_is_no_trial(finds: Replays) -> None:
    broken = tuple(as_broken(r, r.strategy) if r.log == str(FINDS[0]) else r for r in finds)
    found = trial_groups(replace(finds, outcomes=broken), NAMES, GroupBy.SCENARIO)
    assert [log.name for log in found.logs] == ["find-lios.mcap"]
    assert found.left_out == ("find-greedy.mcap: no candidate ran over it. opt-greedy, model-lios: no idea",)


def test_candidates_that_break_on_each_of_them_in_turn_leave_nothing(finds: Replays) -> None:
    pairs = set(zip(map(str, FINDS), NAMES, strict=True))
    broken = tuple(as_broken(r, r.strategy) if (r.log, r.strategy) in pairs else r for r in finds)
    found = trial_groups(replace(finds, outcomes=broken), NAMES, GroupBy.SCENARIO)
    assert found.groups == ()
    assert "no candidate ran over each of the 2 logs" in found.left_out[0]


@pytest.mark.parametrize(("candidates", "code", "words"), [
    ("raising:One,raising:Two", 2, "no candidate ran over it. one, two: it raised RuntimeError: no idea"),
    ("lios,raising:One", 3, "Drive model-lios next: no other candidate ran over every one of these logs."),
    ("lios,greedy,raising:Nope", 3, "left out of the choice: raising:Nope: it raised AttributeError"),
    ("lios,greedy --estimator counts,believing:Raises", 3,
     "left out of the choice: model-lios by raises, opt-greedy by raises: estimator 'raises@1': it raised"),
    ("lios,greedy --estimator nosuch", 2, "lios: no estimator 'nosuch'. Known are"),
])  # fmt: skip
def test_the_command_names_what_broke_in_one_line(
    candidates: str,
    code: int,
    words: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raising.py").write_text(RAISES)
    (tmp_path / "believing.py").write_text(
        "class Raises:\n"
        "    name = 'raises@1'\n"
        "    def believe(self, knowledge, item_types):\n"
        "        raise RuntimeError('no belief')\n"
    )
    assert lios(["select", str(FINDS[0]), "--worlds", "2", "-s", *candidates.split()]) == code
    said = capsys.readouterr()
    (line,) = [line for line in (said.out + said.err).splitlines() if words in line]
    if code == 2:
        assert said.err.splitlines() == [line]


def test_only_trials_that_count_are_asked_where_to_look_next(tmp_path: Path) -> None:
    settings = ReplaySettings(worlds=5)
    replayers.replay(FINDS[0], "pes-lios", settings=settings, output=tmp_path / "kept")
    recorded = next((tmp_path / "kept").rglob("*.mcap"))
    copied = Path(copy(FINDS[0], tmp_path / "again.mcap"))
    made = replayers.replay([FINDS[0], copied, recorded], NAMES, settings=settings)
    (group,) = trial_groups(made, NAMES, GroupBy.SCENARIO).groups
    looks = looks_of_trials(made, [group])
    assert looks
    assert {look.logs for look in looks} == {1}
    assert looks == looks_of_trials(replayers.replay(FINDS[0], NAMES, settings=settings), [group])


def test_where_no_look_settles_anything_one_line_says_why() -> None:
    def look(settles: float, doubt: float) -> SharedLook:
        return SharedLook(place="home", container="bed", logs=1, settles=settles, doubt=doubt, narrows=1.0)

    assert look_lines([look(0.3, 0.4), look(0.0, 0.4)], trials=2, worlds=9) == (
        "look next into bed in home: unopened in 1 of 2 logs, expected to settle 0.30 of 0.40 doubtful comparisons",
    )
    for looks, worlds, words in (
        ([look(0.0, 0.0)] * 3, 9, "not doubtful"),
        ([look(0.0, 0.4)] * 3, 9, "no single one"),
        ([], 0, "--worlds is 0"),
        ([], 9, "left unopened"),
    ):
        (line,) = look_lines(looks, trials=2, worlds=worlds)
        assert line.startswith("no look is advised: ")
        assert words in line


def test_json_names_them_too(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raising.py").write_text(RAISES)
    names = "lios,raising:One,raising:Nope"
    assert lios(["select", str(FINDS[0]), "--worlds", "0", "-s", names, "--look-next", "--json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert [b["strategy"] for b in answer["groups"][0]["broke"]] == ["one"]
    assert [n["strategy"] for n in answer["not_replayed"]] == ["raising:Nope"]
    assert answer["left_out"] == []
    assert (answer["look_next"], len(answer["look_next_words"])) == ([], 1)


def test_trials_with_the_beliefs_of_different_estimators_do_not_count_together(finds: Replays) -> None:
    def of(*estimators: str) -> list[tuple[str, str, int]]:
        by_log = dict(zip(map(str, FINDS), estimators, strict=True))
        outcomes = tuple(msgspec.structs.replace(r, estimator=by_log[r.log]) for r in finds)
        groups = trial_groups(replace(finds, outcomes=outcomes), NAMES, GroupBy.SCENARIO).groups
        return [(group.name, group.beliefs, len(group.trials)) for group in groups]

    assert of("counts@1", "best@2") == [
        ("find, in simulation, beliefs of best", "best", 1),
        ("find, in simulation, beliefs of counts", "counts", 1),
    ]
    assert [beliefs for _, beliefs, _ in of("best@1", "best@2")] == ["best@1", "best@2"], "other weights"
    assert of("best@2", "best@2") == [("find, in simulation", "", 2)]
