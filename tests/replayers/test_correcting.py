"""A person's correction of a log: what may be said, what a replay makes of it, and that every answer tells it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sample_logs import write_toy_log
from test_overlooked import FIND_IT, NAMES, PLENTY, cost_in, house_with, house_without, recorded
from toy import COUNTER, DESK, FRIDGE, TABLE, toy_house
from toy_logs import MUG

from recorders.simulated_run import Trial, record_trial
from replayers.batch.verify import verify
from replayers.counterfactual.evidence import evidence_of
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.log_tools.notes import add_note, notes_of
from replayers.runs.correcting import read_correction
from replayers.runs.run import Run, read
from workbench.cli import run as lios
from workbench.execution.events import RunStatus
from workbench.log_schema.corrections import Correction
from workbench.log_schema.events import NANO
from workbench.worlds.house import Item, ItemId


def corrected(run: Run, text: str) -> Run:
    """The log of a run with a correction written into it, read again."""
    evidence = evidence_of(run)
    found = read_correction(text, run, evidence.contents, evidence.known, author="Ada")
    add_note(run.path, found.words, author="Ada", seen=found)
    return read(run.path, with_truth=True)


def told(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """The one line with which a command refuses."""
    assert lios([str(a) for a in arguments]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    return said


@pytest.mark.parametrize("name", NAMES)
def test_with_a_correction_a_replay_costs_what_it_costs_in_the_house_as_it_was(tmp_path: Path, name: str) -> None:
    """Every container was opened, and none showed the mug that the task lists: only the correction settles it."""
    house = house_without(MUG)
    run = recorded(tmp_path, house, FIND_IT)
    before = replay_on(prepare_log(run, ReplaySettings(worlds=0, budget=PLENTY)), name)
    assert (before.status, before.exact) == (RunStatus.UNDETERMINED, False)
    again = corrected(run, f"mug@{TABLE}")
    prepared = prepare_log(again, ReplaySettings(worlds=0, budget=PLENTY))
    after = replay_on(prepared, name)
    assert after.exact
    assert after.cost == pytest.approx(cost_in(house_with(house, {TABLE: (MUG,)}), name, FIND_IT))
    assert prepared.contradicting == ()
    assert f"Ada says that Mug was in {TABLE}" in " ".join(after.notes)


def test_the_recorded_run_still_replays_as_it_was(tmp_path: Path) -> None:
    """The robot did not know what the person knows."""
    run = corrected(recorded(tmp_path, house_without(MUG), FIND_IT), f"mug@{COUNTER}")
    assert evidence_of(run).corrections[0].author == "Ada"
    assert verify(run).same
    assert prepare_log(run, ReplaySettings(worlds=0)).reproduction.same


def test_the_command_writes_it_and_every_answer_tells_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = recorded(tmp_path, house_without(MUG), FIND_IT).path
    assert lios(["log", "note", str(log), "--seen", f"MUG@{TABLE.upper()}", "--at", "3", "--author", "Ada"]) == 0
    assert f"Mug was in {TABLE} (Ada)" in capsys.readouterr().out
    (note,) = notes_of(log)
    assert note.seen is not None
    assert (note.seen.container, note.seen.item.type, note.author) == (TABLE, MUG, "Ada")
    folder = tmp_path / "replays"
    assert lios(["replay", str(log), "-s", "greedy,model-lios", "--worlds", "0", "-o", str(folder), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert all(row["corrections"] == [f"Mug was in {TABLE}"] for row in rows)
    assert lios(["compare", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["corrected"] == {str(log): [f"Mug was in {TABLE}"]}
    assert lios(["compare", str(folder)]) == 0
    assert "1 log was corrected by people" in capsys.readouterr().err
    assert "corrected" in told(capsys, "certify", log, "-s", "greedy", "-o", tmp_path / "claim.zip")


def test_a_run_that_saw_in_passing_still_replays_as_it_was(tmp_path: Path) -> None:
    """What came into view is shown again without the item that the correction adds, as a look is."""
    trial = Trial(house=toy_house(), task=FIND_IT, strategy="opt-greedy", estimator="counts", sees_m=1.6)
    record_trial(trial, tmp_path / "run.mcap")
    run = read(tmp_path / "run.mcap")
    seen = next(o for o in run.observations if o.passing and not o.known_at_start)
    again = corrected(run, f"mug|9@{seen.container}")
    assert evidence_of(again).corrections
    assert verify(again).same


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mug", "ITEM@CONTAINER"),
        ("@desk", "ITEM@CONTAINER"),
        ("mug@attic", "no container 'attic'"),
        (f"spaceship@{TABLE}", "no item type 'spaceship'"),
        (f"mug@{FRIDGE}", "were known at the start"),
        (f"mug@{DESK}", "nobody looked into it"),
    ],
)
def test_what_says_nothing_of_the_run_is_refused(
    tmp_path: Path, text: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_toy_log(tmp_path / "a.mcap")
    before = log.read_bytes()
    assert said in told(capsys, "log", "note", log, "--seen", text)
    assert log.read_bytes() == before


def test_a_moment_outside_the_run_and_an_end_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = write_toy_log(tmp_path / "a.mcap")
    for moment in ("900", "-5"):
        assert "within the run, 0 to" in told(capsys, "log", "note", log, "--seen", f"bowl@{TABLE}", "--at", moment)
    assert "left out" in told(capsys, "log", "note", log, "--seen", f"bowl@{TABLE}", "--until", "9")


def test_what_the_log_knows_better_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An item that a look showed there, one that stood elsewhere, and one said twice."""
    run = read(write_toy_log(tmp_path / "a.mcap"))
    shown = next((o.container, o.items[0]) for o in run.observations if o.items and not o.known_at_start)
    other = next(c for c in (TABLE, COUNTER) if c != shown[0])
    assert "knows of" in told(capsys, "log", "note", run.path, "--seen", f"{shown[1].type}@{shown[0]}")
    assert f"shows it in {shown[0]}" in told(capsys, "log", "note", run.path, "--seen", f"{shown[1].id}@{other}")
    assert lios(["log", "note", str(run.path), "--seen", f"{shown[1].type}|9@{shown[0]}"]) == 0, "a second one"
    capsys.readouterr()
    assert "knows of" in told(capsys, "log", "note", run.path, "--seen", f"{shown[1].type}|9@{shown[0]}")


def test_a_correction_that_contradicts_the_log_is_left_out_and_told(tmp_path: Path) -> None:
    """Written by another program, say."""
    run = read(write_toy_log(tmp_path / "a.mcap"))
    wrong = Correction(
        item=Item(id=ItemId("Mug|7"), type=MUG), container=DESK, stamp_ns=run.info.started.ns + 3 * NANO
    )
    add_note(run.path, wrong.words, seen=wrong)
    evidence = evidence_of(read(run.path))
    assert evidence.corrections == ()
    assert evidence.contents == evidence_of(run).contents
    assert "a correction is left out" in " ".join(evidence.notes)
