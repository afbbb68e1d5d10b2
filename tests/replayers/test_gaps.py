"""What is missing from a run is noticed, told, and nothing is concluded from it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from damaged_logs import chunks_of, flip
from sample_logs import write_toy_log

from replayers.counterfactual.evidence import PartOfRun, StartUnknown, evidence_of
from replayers.runs.contents import contents_at_start
from replayers.runs.gaps import gaps_of
from replayers.runs.run import Run, read
from workbench import cli
from workbench.log_schema.events import ActionFinished, Observation, SeenItem, Stamp
from workbench.worlds.house import ContainerId

LOGS = Path(__file__).parents[2] / "logs"


@pytest.fixture(scope="module")
def run() -> Run:
    return read(LOGS / "deliver-3.mcap")


def test_shipped_logs_have_no_gaps():
    for log in sorted(LOGS.glob("*.mcap")):
        assert gaps_of(read(log)).lost == (), log


def test_every_single_decision_that_is_lost_is_noticed_and_never_counts_as_seen(run: Run):
    whole = evidence_of(run)
    noticed = 0
    for decision in range(1, len(run.plans) + 1):
        torn = replace(
            run,
            **{
                name: tuple(event for event in getattr(run, name) if event.decision != decision)
                for name in ("observations", "beliefs", "plans", "actions", "find_costs", "timings")
            },
        )
        try:
            evidence = evidence_of(torn)
        except StartUnknown:
            assert decision == 1
            noticed += 1
            continue
        assert evidence.notes, decision
        assert evidence.gaps.lost, decision
        for container, items in evidence.contents.items():
            assert items == whole.contents[container], (decision, container)
        noticed += 1
    assert noticed == len(run.plans)


def test_a_single_lost_observation_opens_its_container(run: Run):
    whole = evidence_of(run)
    for lost in run.observations:
        torn = replace(
            run,
            observations=tuple(o for o in run.observations if o is not lost),
            skipped={"/search/observation": 1},
        )
        if lost.known_at_start:
            with pytest.raises(StartUnknown, match=lost.container):
                evidence_of(torn)
            continue
        evidence = evidence_of(torn)
        assert lost.container in evidence.open or lost.container in evidence.gaps.not_looked
        assert lost.container not in evidence.contents
        assert all(items == whole.contents[c] for c, items in evidence.contents.items())
        assert lost.container in " ".join(evidence.notes)


def test_a_log_that_merely_ends_early_has_no_gaps(run: Run):
    for count in range(len(run.actions)):
        last = run.actions[count].stamp.ns if count else run.info.started.ns
        cut = replace(
            run,
            observations=tuple(o for o in run.observations if o.stamp.ns <= last),
            actions=run.actions[: count + 1] if count else (),
            outcome=None,
            closed=False,
            complete=False,
        )
        assert gaps_of(cut).lost == (), count


def test_what_was_carried_before_it_is_first_seen_did_not_stand_there_at_the_start():
    def at(second: int) -> Stamp:
        return Stamp(sec=second, nsec=0)

    placed = ActionFinished(
        stamp=at(5), decision=1, index=1, start=at(4), action="place", origin="table", target="table",
        item_types=("cup",), items=("cup1",), cost=0.0, success=True,
    )  # fmt: skip
    seen = Observation(
        stamp=at(9),
        decision=2,
        container="table",
        items=(SeenItem(id="cup1", type="cup"), SeenItem(id="pan1", type="pan")),
        robot_at="table",
    )
    contents, _ = contents_at_start([seen], [placed], (ContainerId("table"),))
    assert [item.id for item in contents[ContainerId("table")]] == ["pan1"]


def test_a_part_alone_is_refused(run: Run):
    with pytest.raises(PartOfRun, match="merge"):
        evidence_of(replace(run, part="1"))
    with pytest.raises(PartOfRun):
        evidence_of(replace(run, part="0", complete=False, outcome=None))
    evidence_of(replace(run, part="0"))


def _bounds(text: str) -> tuple[object, ...]:
    (row,) = json.loads(text)["rows"]
    return row["status"], row["lower"], row["upper"], row["exact"]


def test_a_damaged_chunk_is_told_by_replay_and_by_its_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log, damaged = write_toy_log(tmp_path / "a.mcap"), tmp_path / "b.mcap"
    flip(log, damaged, 1)
    code = cli.run(["replay", str(damaged), "-s", "opt-greedy", "--json"])
    told = capsys.readouterr()
    assert code in (2, 3)
    assert code == 2 or "not whole" in " ".join(json.loads(told.out)["rows"][0]["notes"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["find-greedy", "find-lios", "spot-home-A", "spot-home-C"])
def test_every_answer_that_a_damaged_chunk_changes_carries_a_note(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    log, damaged = LOGS / f"{name}.mcap", tmp_path / "b.mcap"
    assert cli.run(["replay", str(log), "-s", "opt-greedy", "--json"]) == 0
    whole = _bounds(capsys.readouterr().out)
    for number in range(len(chunks_of(log))):
        flip(log, damaged, number)
        code = cli.run(["replay", str(damaged), "-s", "opt-greedy", "--json"])
        told = capsys.readouterr()
        if code == 2:
            assert "missing" in told.err
            continue
        row = json.loads(told.out)["rows"][0]
        assert code == 3 or (code == 0 and _bounds(told.out) == whole), number
        assert code == 0 or row["lost"], number
        if whole[3] and row["lower"] is not None:
            assert row["lower"] - 1e-6 <= whole[1], number  # pyright: ignore[reportOperatorIssue]
            assert row["upper"] is None or whole[1] <= row["upper"] + 1e-6, number


def _lost(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What a command that ends with 3 says is missing."""
    assert cli.run(arguments) == 3, arguments
    told = capsys.readouterr()
    (lines,) = json.loads(told.out)["lost"].values()
    assert "is not whole" in told.err
    return lines


def test_export_and_figures_and_capsule_say_what_is_missing_and_end_with_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    log, short = write_toy_log(tmp_path / "a.mcap"), tmp_path / "b.mcap"
    assert cli.run(["log", "filter", str(log), "-o", str(short), "-S", "5"]) == 0
    capsys.readouterr()
    told = _lost(["export", str(short), "-o", str(tmp_path / "tables"), "-t", "runs", "--json"], capsys)
    assert "2 actions of 6 missing, the first number 1" in told
    assert told == _lost(["capsule", str(short), "-o", str(tmp_path / "b.html"), "--json"], capsys)


@pytest.mark.slow
def test_figures_say_what_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log, short = write_toy_log(tmp_path / "a.mcap"), tmp_path / "b.mcap"
    assert cli.run(["log", "filter", str(log), "-o", str(short), "-S", "5"]) == 0
    capsys.readouterr()
    figures = ["figures", str(short), "-o", str(tmp_path / "f"), "--format", "png", "--json"]
    assert "2 actions of 6 missing, the first number 1" in _lost(figures, capsys)


def test_list_and_doctor_say_what_a_recovered_log_lost(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log, damaged, saved = write_toy_log(tmp_path / "a.mcap"), tmp_path / "b.mcap", tmp_path / "c.mcap"
    flip(log, damaged, 1)
    assert cli.run(["recover", str(damaged), "-o", str(saved)]) == 3
    capsys.readouterr()
    assert cli.run(["list", str(saved), "--json"]) == 3
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["problem"].startswith("recovered")
    assert cli.run(["doctor", str(saved)]) == 3
    assert "messages were saved" in capsys.readouterr().out
