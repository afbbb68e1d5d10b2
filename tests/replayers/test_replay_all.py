"""Many logs and strategies: stored, resumed, recorded with their origin, and compared world by world."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd
import pytest
from sample_logs import killed_toy_log
from toy import BED, COUNTER
from toy_logs import InOrder, delivered, simulated_log, task_of, toy_run
from toy_replays import NAMES, wanted

from replayers.batch.replay_all import (
    LogFailed,
    ReplayRequest,
    log_path,
    logs_among,
    replay_all,
    replay_log,
    strategies_named,
)
from replayers.batch.replay_tables import replays_frame, steps_frame
from replayers.batch.store import (
    StoredReplay,
    read_replay,
    replay_key,
    replay_path,
    replays_in,
    to_stored,
    write_replay,
)
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_strategy
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.errors import FileMissing, MalformedFile


def test_replays_are_kept_and_not_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, folder = simulated_log(tmp_path / "run.mcap"), tmp_path / "replays"
    first = list(replay_log(log, wanted(folder)))
    assert [r.strategy for r in first] == list(NAMES)
    monkeypatch.setattr("replayers.batch.log_replayer.replay_on", lambda *_, **__: pytest.fail("made again"))
    assert list(replay_log(log, wanted(folder))) == first
    other = replace(wanted(folder), settings=ReplaySettings(worlds=51))
    with pytest.raises(pytest.fail.Exception):
        list(replay_log(log, other))


NOTHING_FOLLOWED = Budget(segments=0, finish=0)


def writing(folder: Path, told: tuple[str, ...], **settings: Any) -> ReplayRequest:
    """One strategy that looks into a container that the log of killed_toy_log does not open."""
    made = ReplaySettings(**{"worlds": 20, **settings})
    return ReplayRequest(strategies=("opt-greedy",), settings=made, output=folder, write_logs=True, worlds=told)


@pytest.mark.parametrize(
    ("told", "settings"),
    [(("best", "worst"), {"budget": NOTHING_FOLLOWED, "worlds": 0}), (("drawn",), {"worlds": 0})],
    ids=["none was followed to its end", "none was drawn"],
)
def test_a_world_in_which_there_is_no_run_is_not_sought_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, told: tuple[str, ...], settings: dict[str, Any]
) -> None:
    log, asked = killed_toy_log(tmp_path / "run.mcap", events=4), writing(tmp_path / "kept", told, **settings)
    first = list(replay_log(log, asked))
    assert [path.name for path in (tmp_path / "kept").rglob("*.mcap")] == ["opt-greedy.replay.mcap"]
    monkeypatch.setattr("replayers.batch.log_replayer.replay_on", lambda *_, **__: pytest.fail("made again"))
    assert list(replay_log(log, asked)) == first
    with pytest.raises(pytest.fail.Exception):
        list(replay_log(log, writing(tmp_path / "kept", ("best", "drawn"))))


def test_runs_in_worlds_go_with_the_replay_that_they_are_of(tmp_path: Path) -> None:
    log, folder = killed_toy_log(tmp_path / "run.mcap", events=4), tmp_path / "kept"

    def names_after(told: tuple[str, ...], **settings: Any) -> set[str]:
        list(replay_log(log, writing(folder, told, **settings)))
        return {path.name.removesuffix(".replay.mcap") for path in folder.rglob("*.mcap")}

    assert names_after(("best", "worst")) == {"opt-greedy", "opt-greedy.best", "opt-greedy.worst"}
    assert names_after(("drawn",)) == {"opt-greedy", "opt-greedy.best", "opt-greedy.worst", "opt-greedy.drawn"}
    assert names_after((), worlds=30) == {"opt-greedy"}
    assert names_after(("best",), worlds=30) == {"opt-greedy", "opt-greedy.best"}


def test_a_damaged_replay_is_made_again(tmp_path: Path) -> None:
    log, folder = simulated_log(tmp_path / "run.mcap"), tmp_path / "replays"
    made = next(replay_log(log, wanted(folder)))
    assert isinstance(made, StoredReplay)
    path = replay_path(folder, made.sha256, made.run_id, made.strategy)
    path.write_text('{"version": 1')
    with pytest.raises(MalformedFile, match="stored replay"):
        read_replay(path)
    assert next(replay_log(log, wanted(folder))) == made
    assert read_replay(path) == made


def test_bounds_without_a_run_to_its_end_are_kept_and_read_again(tmp_path: Path) -> None:
    """Nothing is followed beyond the first question: no cost was found that some world certainly has."""
    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=0, budget=Budget(segments=0, finish=0)))
    made = to_stored(prepared, replay_strategy(prepared, InOrder((BED, COUNTER))), key="k")
    assert made.bounds is not None
    assert (made.bounds.least_found, made.bounds.largest_found) == (inf, -inf)
    assert (made.bounds.lower, made.bounds.upper) != (None, None)
    write_replay(tmp_path / "made.replay.json", made)
    assert read_replay(tmp_path / "made.replay.json") == made


def test_the_key_holds_whatever_the_answer_depends_on() -> None:
    base = replay_key("log", "lios", ReplaySettings())
    assert base == replay_key("log", "lios", ReplaySettings())
    others = (
        replay_key("other", "lios", ReplaySettings()),
        replay_key("log", "greedy", ReplaySettings()),
        replay_key("log", "lios", ReplaySettings(seed=1)),
        replay_key("log", "lios", ReplaySettings(with_truth=True)),
    )
    assert len({base, *others}) == 5


def test_a_replay_is_recorded_with_its_origin(tmp_path: Path) -> None:
    log, folder = simulated_log(tmp_path / "run.mcap"), tmp_path / "replays"
    made = next(replay_log(log, wanted(folder, write_logs=True)))
    assert isinstance(made, StoredReplay)
    replayed, driven = read(log_path(replay_path(folder, made.sha256, made.run_id, made.strategy))), read(log)
    assert replayed.info.source == "replay"
    assert replayed.info.origin_run == driven.info.run_id
    assert replayed.info.origin_sha256 == driven.sha256
    assert replayed.info.run_id != driven.info.run_id
    assert replayed.info.strategy == made.strategy
    assert replayed.truth is None
    assert replayed.task == driven.task
    assert {a.support for a in replayed.actions} <= {"logged", "implied", "imputed"}
    assert replayed.outcome is not None
    assert replayed.outcome.status == made.status


def test_folders_give_their_logs_but_not_their_replays(tmp_path: Path) -> None:
    log = simulated_log(tmp_path / "b" / "run.mcap") if (tmp_path / "b").mkdir() is None else None
    assert log is not None
    list(replay_log(log, wanted(tmp_path / "b" / "replays", write_logs=True)))
    assert logs_among([tmp_path / "b"]) == (log,)
    assert logs_among([log, tmp_path / "b"]) == (log,)
    assert logs_among([tmp_path / "**" / "*.mcap"]) == (log,)
    with pytest.raises(FileMissing):
        logs_among([tmp_path / "b" / "none-*.mcap"])
    with pytest.raises(FileMissing):
        logs_among([tmp_path / "nowhere"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(MalformedFile, match=r"no \.mcap"):
        logs_among([tmp_path / "empty"])


def test_a_log_that_is_cut_off_is_replayed_as_far_as_it_goes_and_says_so(tmp_path: Path) -> None:
    log = killed_toy_log(tmp_path / "killed.mcap", events=9)
    made = [r for r in replay_log(log, wanted()) if isinstance(r, StoredReplay)]
    assert len(made) == len(NAMES)
    for record in made:
        assert not record.complete_log
        assert record.recorded_status == "cut off"
        assert record.recorded_cost is None
        assert any("cut off" in note for note in record.notes)
        assert record.bounds is not None


def test_a_run_that_failed_is_evidence_like_any_other(tmp_path: Path) -> None:
    """It looked everywhere in vain, so that no container is open: every strategy fails."""
    log = simulated_log(tmp_path / "run.mcap", name="opt-greedy", task=task_of(delivered("Teapot", BED)))
    run = read(log)
    assert run.outcome is not None
    assert run.outcome.status != "done"
    made = [r for r in replay_log(log, wanted()) if isinstance(r, StoredReplay)]
    assert [(r.exact, r.cost) for r in made] == [(True, 400.0)] * len(NAMES)


def test_a_log_that_cannot_be_read_stops_no_other(tmp_path: Path) -> None:
    broken = tmp_path / "a.mcap"
    broken.write_bytes(b"not an mcap file at all")
    good = simulated_log(tmp_path / "b.mcap")
    outcomes = list(replay_all([broken, good], wanted(), workers=1))
    assert isinstance(outcomes[0], LogFailed)
    assert "a.mcap" in outcomes[0].reason
    assert [type(o) for o in outcomes[1:]] == [StoredReplay] * 3


@pytest.mark.slow
def test_more_workers_give_the_same_replays_in_the_same_order(tmp_path: Path) -> None:
    logs = [simulated_log(tmp_path / f"{n}.mcap", name=n, run_id=n) for n in ("opt-greedy", "model-lios")]
    one, two = (list(replay_all(logs, wanted(), workers=n)) for n in (1, 2))
    assert msgspec.json.encode(one) == msgspec.json.encode(two)


def test_all_means_every_strategy_that_needs_no_truth() -> None:
    assert "oracle" not in strategies_named("all", with_truth=False)
    assert "oracle" in strategies_named("all", with_truth=True)
    assert strategies_named("Greedy, ModelLIOS,lios", with_truth=False) == ("opt-greedy", "model-lios")


@pytest.mark.parametrize("world", ["best", "worst", "drawn"])
def test_a_log_of_an_imagined_world_says_that_its_contents_are_imputed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], world: str
) -> None:
    log, folder = killed_toy_log(tmp_path / "run.mcap"), tmp_path / "replays"
    (made,) = replay_log(log, writing(folder, (world,)))
    assert isinstance(made, StoredReplay)
    assert made.imputed == ()
    path = log_path(replay_path(folder, made.sha256, made.run_id, made.strategy), world)
    again = tmp_path / "again"
    assert lios(["replay", str(path), "-s", "opt-greedy,pes-greedy", "-o", str(again), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert all(row["imputed"] for row in rows)
    assert all("imagined world" in row["notes"][0] for row in rows)
    assert lios(["replay", str(path), "-s", "opt-greedy"]) == 0
    assert "imputed, nobody saw it" in capsys.readouterr().err
    assert lios(["compare", str(again), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["imagined_logs"] == [str(path)]
    assert lios(["compare", str(again)]) == 0
    assert "of imagined worlds" in capsys.readouterr().err
    assert lios(["replay", str(log), "-s", "opt-greedy", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["imputed"] == []


def test_a_list_marks_logs_of_imagined_worlds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The toy robot's run leaves two containers open; the log of the replay over the log alone imagines neither."""
    log, folder = killed_toy_log(tmp_path / "run.mcap"), tmp_path / "replays"
    (made,) = replay_log(log, writing(folder, ("worst",)))
    assert isinstance(made, StoredReplay)
    alone = replay_path(folder, made.sha256, made.run_id, made.strategy)
    worst = log_path(alone, "worst")
    assert lios(["list", str(tmp_path), "--json"]) == 0
    rows = {Path(row["file"]).name: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert rows[worst.name]["imputed"] >= 1
    assert {row["imputed"] for name, row in rows.items() if name != worst.name} == {0}
    assert lios(["list", str(tmp_path)]) == 0
    shown = capsys.readouterr()
    assert "imputed" in shown.out
    assert "1 of imagined worlds" in shown.err
    assert lios(["list", str(log)]) == 0
    assert "imputed" not in capsys.readouterr().out


def test_frames_have_a_row_a_replay_and_a_row_a_step(tmp_path: Path) -> None:
    records = [r for r in replay_log(simulated_log(tmp_path / "run.mcap"), wanted()) if isinstance(r, StoredReplay)]
    replays, steps = replays_frame(records), steps_frame(records)
    assert list(replays["strategy"]) == list(NAMES)
    assert (replays["lower"] <= replays["upper"]).all()
    assert len(steps) == sum(len(r.steps) for r in records)
    assert set(steps["support"]) <= {"logged", "implied", "imputed"}
    assert steps_frame([]).empty


def test_the_commands_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, folder = simulated_log(tmp_path / "run with 'spaces' [1].mcap"), tmp_path / "replays"
    arguments = [str(log), "--strategies", "all", "--with-truth", "-o", str(folder), "--worlds", "50", "--look-next"]
    assert lios(["replay", *arguments, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    rows = {row["strategy"]: row for row in answer["rows"]}
    assert {"log", "strategy", "status", "lower", "upper", "estimate", "exact"} <= set(rows["model-lios"])
    assert rows["model-lios"]["exact"]
    for row in rows.values():
        if row["lower"] is not None:
            assert row["lower"] - 1e-6 <= row["true_cost"] <= row["upper"] + 1e-6
    assert lios(["replay", *arguments]) == 0
    assert "opt-greedy" in capsys.readouterr().out
    assert lios(["compare", str(folder), "--json", "--frames"]) == 0
    compared = json.loads(capsys.readouterr().out)
    assert {"a", "b", "wins", "undecided", "loses"} <= set(compared["rows"][0])
    assert len(pd.read_parquet(folder / "replays.parquet")) == len(list(replays_in(folder)))
    assert lios(["compare", str(folder), "-k", "oracle opt"]) == 0
    assert "No pair's names contain 'oracle opt'. There are: conditioned-lios, model-lios" in capsys.readouterr().err
    assert lios(["compare", str(folder), "-k", "OPT-greedy"]) == 0
    assert "model-lios" in capsys.readouterr().out
    assert lios(["replay", str(log), "--verify"]) == 0
    capsys.readouterr()
    assert lios(["replay", str(log), "--strategies", "oracle@everywhere"]) == 2
    assert "oracle@everywhere: it knows the whole house" in capsys.readouterr().err
    assert lios(["replay", str(log), "--strategies", "PesLIOS@sas-blind,pes-lios", "--json"]) == 0
    with_solver, plain = json.loads(capsys.readouterr().out)["rows"]
    assert (with_solver["strategy"], plain["strategy"]) == ("pes-lios@sas-blind", "pes-lios")
    assert (with_solver["lower"], with_solver["upper"]) == (plain["lower"], plain["upper"])


def test_bad_input_is_one_line_and_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = simulated_log(tmp_path / "run.mcap", truth=False)
    (tmp_path / "empty").mkdir()
    for arguments in (
        ["replay", str(tmp_path / "nowhere.mcap")],
        ["replay", str(log), "--strategies", "no-such-strategy"],
        ["replay", str(log), "--strategies", "oracle"],
        ["replay", str(log), "--strategies", "lios", "--with-truth"],
        ["replay", str(log), "--strategies", "lios", "--estimator", "no-such-estimator"],
        ["replay", str(tmp_path / "empty")],
        ["compare", str(tmp_path / "empty")],
        ["compare", str(tmp_path / "nowhere")],
    ):
        assert lios(arguments) == 2, arguments
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.startswith("lios: ")
        assert captured.err.count("\n") == 1


def test_a_log_that_is_not_what_its_strategy_does_fails_verification(tmp_path: Path) -> None:
    toy_run(tmp_path)
    assert lios(["replay", str(tmp_path / "toy.mcap"), "--verify", "--json"]) == 1
