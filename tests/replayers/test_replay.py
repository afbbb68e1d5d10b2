"""Every kind of bad or odd input through the command line has the meaning that docs/replay.md, "Odd logs", gives
it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest
from fake_world import FakeWorld
from sample_logs import T0, killed_toy_log, record_run, toy_info, toy_place
from toy import DESK, FRIDGE, TABLE, item
from toy_logs import MUG, simulated_log

from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from replayers.batch.replay_all import log_path
from replayers.batch.store import replay_path
from replayers.counterfactual.decisions import same_decision
from replayers.runs.run import read
from workbench.beliefs.estimators import estimator
from workbench.cli import run as lios
from workbench.execution.events import BeliefUpdated, ContainerObserved, Event, RunStatus
from workbench.execution.loop import run_task
from workbench.planning.strategies import strategy
from workbench.planning.tasks import find_task
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START

Change = Callable[[list[Event]], list[Event]]


def changed_log(path: Path, change: Change, **options: Any) -> Path:
    """A simulated find of the mug by the greedy strategy, with other events than really happened."""
    world, task = FakeWorld(known=(FRIDGE,), clock_ns=T0), find_task(MUG, START)
    believer = estimator("counts")
    events = list(run_task(world, strategy("opt-greedy"), believer, task, costs=SIMULATION_COSTS, seed=7))
    about = {"strategy": "opt-greedy", "estimator": believer.name, "scenario": task.scenario} | options
    info = toy_info(**about)
    record_run(path, change(events), info=info, place=toy_place(), task=task, costs=SIMULATION_COSTS)
    return path


def rows(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[dict[str, Any]]:
    assert lios(["replay", *arguments, "--worlds", "20", "--json"]) == 0
    return json.loads(capsys.readouterr().out)["rows"]


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert lios(list(arguments)) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("lios: ")
    assert captured.err.count("\n") == 1
    return captured.err


def test_a_log_cut_off_in_the_middle_is_replayed_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = killed_toy_log(tmp_path / "killed.mcap", events=9)
    for row in rows(capsys, str(log), "-s", "greedy,lios"):
        assert not row["complete_log"]
        assert row["recorded_cost"] is None
        assert any("cut off" in note for note in row["notes"])
        assert row["lower"] <= row["upper"]


@pytest.mark.parametrize("lacks", ["task.json", "place.json", "settings.json"])
def test_a_log_without_a_task_a_place_or_costs_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lacks: str
) -> None:
    log = without_attachment(simulated_log(tmp_path / "whole.mcap"), tmp_path / "less.mcap", lacks)
    for arguments in (["-s", "greedy"], ["--verify"]):
        said = refused(capsys, "replay", str(log), *arguments)
        assert lacks in said
        assert "less.mcap" in said


def without_attachment(whole: Path, path: Path, name: str) -> Path:
    from mcap.reader import make_reader
    from mcap.writer import Writer

    with open(whole, "rb") as stream, open(path, "wb") as out:
        reader, writer = make_reader(stream), Writer(out)
        writer.start()
        for found in reader.iter_attachments():
            if found.name != name:
                writer.add_attachment(found.create_time, found.log_time, found.name, found.media_type, found.data)
        for found in reader.iter_metadata():
            writer.add_metadata(found.name, found.metadata)
        writer.finish()
    return path


def test_among_others_a_log_that_cannot_be_replayed_is_a_row_that_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    without_attachment(simulated_log(tmp_path / "whole.mcap"), folder / "a.mcap", "task.json")
    simulated_log(folder / "b.mcap")
    found = rows(capsys, str(folder), "-s", "greedy", "--workers", "1")
    assert [(row["status"], row["exact"]) for row in found] == [("not-replayed", False), ("done", True)]
    assert "task.json" in found[0]["reason"]


@pytest.mark.ci
def test_the_next_look_is_told_though_a_log_among_others_is_no_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.mcap").write_bytes(b"not an mcap file at all")
    changed_log(tmp_path / "b.mcap", lambda events: [e for e in events if isinstance(e, ContainerObserved)][:1])
    assert lios(["replay", str(tmp_path), "-s", "greedy,lios", "--worlds", "20", "--look-next", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["status"] for row in answer["rows"]] == ["not-replayed", "undetermined", "undetermined"]
    assert [look["log"] for look in answer["look_next"]] == [str(tmp_path / "b.mcap")]


def test_a_belief_over_a_container_that_is_not_there_is_left_out_with_a_note(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def with_sofa(events: list[Event]) -> list[Event]:
        return [replace(e, belief=_of_a_sofa(e.belief)) if isinstance(e, BeliefUpdated) else e for e in events]

    (row,) = rows(capsys, str(changed_log(tmp_path / "sofa.mcap", with_sofa)), "-s", "lios")
    assert any("Sofa|9" in note and "left out" in note for note in row["notes"])
    assert row["lower"] is not None


def _of_a_sofa(belief: Any) -> Any:
    import numpy as np

    return replace(
        belief,
        containers=(*belief.containers, "Sofa|9"),
        probability=np.hstack([belief.probability, np.full((len(belief.item_types), 1), 0.5)]),
    )


def test_two_instances_of_one_type_both_count(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A second mug on the table, which is nearer: the greedy strategy ends there, 1 m away, after 1 + 5 + 1."""
    log = changed_log(tmp_path / "two.mcap", lambda events: seen_too(events, TABLE, "Mug|2"), strategy="somebody")
    (row,) = rows(capsys, str(log), "-s", "greedy")
    assert row["exact"]
    assert row["cost"] == 7.0


def test_an_item_seen_in_two_places_stands_where_it_was_seen_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table is looked into before the counter: the mug that is seen in both is the table's."""
    log = changed_log(tmp_path / "both.mcap", lambda events: seen_too(events, TABLE, "Mug|1"), strategy="somebody")
    (row,) = rows(capsys, str(log), "-s", "greedy")
    assert row["cost"] == 7.0
    assert any("was seen in" in note and "it is read as standing in" in note for note in row["notes"])


def test_a_run_that_its_own_strategy_would_not_have_made_says_nothing_of_any(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It walked past a mug that it saw: whatever decided that is not here, and no strategy gets a figure."""
    log = changed_log(tmp_path / "two.mcap", lambda events: seen_too(events, TABLE, "Mug|2"))
    assert lios(["replay", str(log), "-s", "greedy,lios", "--worlds", "20", "--json"]) != 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)["rows"]
    assert {row["status"] for row in found} == {"not-reproduced"}
    for row in found:
        figures = ("cost", "lower", "upper", "estimate", "interval90", "if_beliefs_stand", "true_cost")
        assert [row[name] for name in figures] == [None] * len(figures)
        assert row["reproduced"] is False
        assert not row["exact"]
        assert any("does not do here what was recorded" in note for note in row["notes"])
    assert "not reproduced" in captured.err


def seen_too(events: list[Event], container: str, thing: str) -> list[Event]:
    def see(event: Event) -> Event:
        if isinstance(event, ContainerObserved) and event.container == container:
            return replace(event, items=(*event.items, item(thing)))
        return event

    return [see(event) for event in events]


def test_a_run_that_failed_says_nothing_of_what_it_did_not_open(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was broken off at the start: everything is open, and a mug may be anywhere."""

    def broken_off(events: list[Event]) -> list[Event]:
        known = [e for e in events if isinstance(e, ContainerObserved) and e.known_at_start]
        end = replace(
            events[-1],
            status=RunStatus.ABORTED,
            cost=400.0,
            own_cost=0.0,
            searches=0,
            travel_m=0.0,
            reason="battery",
        )
        return [*known, end]

    log = changed_log(tmp_path / "failed.mcap", broken_off)
    (row,) = rows(capsys, str(log), "-s", "greedy", "--no-inventory")
    assert row["recorded_cost"] == 400.0
    assert row["status"] == "undetermined"
    assert row["lower"] < row["upper"]


def test_houses_that_changed_between_two_runs_are_two_houses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    simulated_log(logs / "a.mcap", run_id="a")
    world, task, believer = FakeWorld(known=(FRIDGE,), clock_ns=T0), find_task(MUG, START), estimator("counts")
    place = toy_place()
    moved = replace(place, plan=replace(place.plan, containers=tuple(
        replace(c, size_m=(1.0, 1.0, 1.0)) if c.id == DESK else c for c in place.plan.containers
    )))  # fmt: skip
    record_run(
        logs / "b.mcap",
        run_task(world, strategy("opt-greedy"), believer, task, costs=SIMULATION_COSTS, seed=7),
        info=toy_info(strategy="opt-greedy", estimator=believer.name, run_id="b", scenario=task.scenario),
        place=moved, task=task, costs=SIMULATION_COSTS,
    )  # fmt: skip
    kept = tmp_path / "kept"
    rows(capsys, str(logs), "-s", "greedy,lios", "-o", str(kept), "--workers", "1")
    assert lios(["compare", str(kept), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["changed_houses"] == ["toy"]
    assert answer["rows"][0]["houses"] == 2
    assert lios(["compare", str(kept)]) == 0
    assert "its versions count as different houses" in capsys.readouterr().err


def test_compare_skips_what_another_release_kept_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, kept = simulated_log(tmp_path / "run.mcap"), tmp_path / "kept"
    rows(capsys, str(log), "-s", "greedy,lios,conditioned-lios", "-o", str(kept))
    old, broken, _ = sorted(kept.rglob("*.replay.json"))
    old.write_bytes(msgspec.json.encode(msgspec.json.decode(old.read_bytes()) | {"version": 1}))
    assert lios(["compare", str(kept), "--json"]) == 0
    captured = capsys.readouterr()
    answer = json.loads(captured.out)
    assert answer["replays"] == 2
    assert len(answer["skipped"]) == 1
    assert "version 1" in captured.err
    assert "lios replay LOG -o DIR" in captured.err
    broken.write_text("{")
    assert lios(["compare", str(kept), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["skipped"]) == 2


def test_the_worlds_at_the_ends_of_the_bounds_are_written_and_read_as_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log that knows the fridge alone; a pencil that nobody saw: in the best world it is at the first look."""
    log = simulated_log(tmp_path / "run.mcap", name="opt-greedy")
    cut = changed_log(
        tmp_path / "cut.mcap", lambda events: [e for e in events if isinstance(e, ContainerObserved)][:1]
    )
    kept = tmp_path / "kept"
    (row,) = rows(capsys, str(cut), "-s", "greedy", "-o", str(kept), "--write", "best,worst,drawn")
    run = read(cut)
    json_path = replay_path(kept, run.sha256, run.info.run_id, "opt-greedy")
    best, worst, drawn = (read(log_path(json_path, world)) for world in ("best", "worst", "drawn"))
    assert best.outcome is not None
    assert worst.outcome is not None
    assert drawn.outcome is not None
    assert best.outcome.cost == pytest.approx(row["lower"], abs=1e-5)
    assert worst.outcome.cost == pytest.approx(row["upper"], abs=1e-5)
    assert row["lower"] - 1e-5 <= drawn.outcome.cost <= row["upper"] + 1e-5
    assert len({r.info.run_id for r in (best, worst, drawn, run)}) == 4
    assert all(r.info.origin_sha256 == run.sha256 and r.info.source == "replay" for r in (best, worst, drawn))
    assert "imputed" in {a.support for a in worst.actions}
    assert "most expensive world" in worst.info.title
    for told in (best, worst, drawn):
        timeline = timeline_of(told)
        assert scene_at(timeline, timeline.end_ns) is not None
    again = rows(capsys, str(cut), "-s", "greedy", "-o", str(kept), "--write", "worst")
    assert again == [row]
    assert "--write" in refused(capsys, "replay", str(log), "--write", "best")
    assert "drawn" in refused(capsys, "replay", str(log), "--write", "middling", "-o", str(kept))


def test_beliefs_that_follow_what_is_seen_give_bounds_that_hold_and_others_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cut = changed_log(
        tmp_path / "cut.mcap", lambda events: [e for e in events if isinstance(e, ContainerObserved)][:1]
    )
    greedy, ours = rows(capsys, str(cut), "-s", "greedy,lios", "--estimator", "best")
    assert greedy["complete"]
    assert greedy["if_beliefs_stand"] is None
    assert not ours["steady_beliefs"]
    assert ours["complete"]  # whatever else is in the containers, it looks in the same order
    assert ours["if_beliefs_stand"] is None
    monkeypatch.setattr(same_decision, "MAX_BELIEFS", 1)
    (ours,) = rows(capsys, str(cut), "-s", "lios", "--estimator", "best")
    assert ours["lower"] <= ours["if_beliefs_stand"]["lower"] <= ours["if_beliefs_stand"]["upper"] <= ours["upper"]
    assert lios(["replay", str(cut), "-s", "lios", "--estimator", "best"]) == 0
    assert "if beliefs stand" in capsys.readouterr().out


def test_a_planner_whose_module_is_not_there_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = simulated_log(tmp_path / "run.mcap")
    assert "no_such_planner" in refused(capsys, "replay", str(log), "-s", "opt-greedy,no_such_planner:Mine")


def test_a_planner_that_breaks_is_a_row_and_a_failure_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log = simulated_log(tmp_path / "run.mcap")
    (tmp_path / "raising_planner.py").write_text(
        'class Mine:\n    name = "mine"\n    def relevant_types(self, task): return ()\n'
        '    def decide(self, view): raise RuntimeError("out of ideas")\n',
        encoding="utf-8",
    )
    monkeypatch.chdir(tmp_path)
    assert lios(["replay", str(log), "-s", "raising_planner:Mine,opt-greedy", "--worlds", "20"]) == 1
    said = capsys.readouterr()
    assert "planner-failed" in said.out
    assert "opt-greedy" in said.out
    assert said.err == "lios: mine broke on 1 of 1 log: it raised RuntimeError: out of ideas\n"
    assert lios(["replay", str(log), "-s", "raising_planner:Mine", "--worlds", "20", "--json"]) == 1
    said = capsys.readouterr()
    assert [row["status"] for row in json.loads(said.out)["rows"]] == ["planner-failed"]
    assert said.err == "lios: mine broke on 1 of 1 log: it raised RuntimeError: out of ideas\n"


def own_planner(folder: Path, module: str, body: str) -> None:
    (folder / f"{module}.py").write_text(
        f'class Mine:\n    name = "mine"\n    def relevant_types(self, task): return ("Mug",)\n{body}\n',
        encoding="utf-8",
    )


def test_a_misspelt_class_is_refused_and_among_others_a_row_and_a_failure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log = simulated_log(tmp_path / "run.mcap")
    own_planner(tmp_path, "planner_here", "    def decide(self, view): raise RuntimeError")
    monkeypatch.chdir(tmp_path)
    assert "Missing" in refused(capsys, "replay", str(log), "-s", "planner_here:Missing")
    assert lios(["replay", str(log), "-s", "planner_here:Missing,opt-greedy", "--worlds", "0", "--json"]) == 1
    said = capsys.readouterr()
    done, missing = json.loads(said.out)["rows"]
    assert done["status"] != "not-replayed"
    assert (missing["strategy"], missing["status"], missing["exact"]) == (
        "planner_here:Missing",
        "not-replayed",
        False,
    )
    assert "it raised AttributeError" in missing["reason"]
    assert said.err.count("planner_here:Missing cannot be loaded") == 1


@pytest.mark.ci
def test_compare_says_on_how_many_logs_a_planner_broke(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log, kept = simulated_log(tmp_path / "run.mcap"), tmp_path / "kept"
    own_planner(tmp_path, "planner_that_breaks", '    def decide(self, view): raise RuntimeError("out of ideas")')
    monkeypatch.chdir(tmp_path)
    named = "planner_that_breaks:Mine,opt-greedy,pes-greedy"
    assert lios(["replay", str(log), "-s", named, "-o", str(kept), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["rows"]
    assert [(row["status"] == "planner-failed", row["lower"] is None) for row in found] == [
        (True, True), (False, False), (False, False)
    ]  # fmt: skip
    assert (found[0]["cost"], found[0]["exact"]) == (None, False)
    assert lios(["compare", str(kept)]) == 0
    assert (
        "mine broke on 1 of 1 logs; they are left out of its pairs: it raised RuntimeError" in capsys.readouterr().err
    )


def test_of_several_logs_a_note_names_those_that_it_is_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole, killed = simulated_log(tmp_path / "whole.mcap"), killed_toy_log(tmp_path / "killed.mcap", events=9)
    assert lios(["replay", str(whole), str(killed), "-s", "opt-greedy", "--worlds", "0"]) == 0
    assert "note on killed.mcap: the log is cut off: what it holds is replayed\n" in capsys.readouterr().err
    assert lios(["replay", str(killed), "-s", "opt-greedy", "--worlds", "0"]) == 0
    assert "note: the log is cut off: what it holds is replayed\n" in capsys.readouterr().err
