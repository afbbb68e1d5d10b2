"""Verification: a simulated log is what its strategy does; for others the first divergence is named, and why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from sample_logs import killed_toy_log
from toy import BED, COUNTER
from toy_logs import delivered, simulated_log, task_of, toy_run

from replayers.batch.recorded_strategy import UnknownRecordedStrategy
from replayers.batch.replan import replan
from replayers.batch.verify import FORMER_SOLVERS, verify
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.counterfactual.replay import replay
from replayers.runs.run import read
from workbench.errors import Unsupported
from workbench.planning.strategies import strategy_names
from workbench.planning.tasks import AllOf
from workbench.plugins import NameOrigin

TWO = task_of(AllOf(parts=(delivered("Mug", BED), delivered("Book", COUNTER))))


@pytest.mark.parametrize("name", strategy_names(with_truth=True))
@pytest.mark.parametrize("task", [None, TWO], ids=["find", "deliveries"])
def test_a_simulated_log_comes_out_the_same_decision_by_decision(tmp_path: Path, name: str, task: object) -> None:
    run = read(simulated_log(tmp_path / "run.mcap", name=name, task=task), with_truth=True)  # type: ignore[arg-type]
    answer = verify(run)
    assert answer.divergence is None
    assert answer.same
    assert answer.decisions == len(run.plans)
    assert answer.events >= len(run.plans) + len(run.actions) + len(run.observations)


def test_who_opened_the_furniture_is_not_the_strategys_doing() -> None:
    """A replay opens nothing; the log of a robot names the operator."""
    run = read(Path(__file__).parents[2] / "logs" / "spot-home-C.mcap")
    assert "operator" in {o.opened_by for o in run.observations}
    answer = verify(run)
    assert answer.same, answer.divergence


def test_a_log_of_schema_version_1_reads_verifies_and_replays_as_its_release_did() -> None:
    """A robot's, kept for this: its beliefs are rounded, and a plan that was not found would cost 0.0 in it."""
    run = read(Path(__file__).parent / "old_logs" / "spot-schema-1.mcap")
    assert (run.info.schema_version, run.complete, len(run.plans), len(run.actions)) == (1, True, 7, 18)
    assert run.outcome is not None
    assert run.outcome.cost == pytest.approx(53.956873)
    assert (verify(run).same, verify(run).decisions) == (True, 7)
    made = replay(run, "pes-greedy", ReplaySettings(worlds=0))
    assert made.exact
    assert made.cost == pytest.approx(54.716043)


@pytest.mark.parametrize("name", ["model-lios@sas-blind", "conditioned-lios@everywhere", "oracle@everywhere"])
def test_a_log_of_a_strategy_with_another_solver_comes_out_the_same(tmp_path: Path, name: str) -> None:
    path = simulated_log(tmp_path / "run.mcap", name=name, task=TWO)
    answer = verify(read(path, with_truth=True))
    assert answer.same
    assert answer.decisions > 0


def test_a_log_of_the_search_that_a_name_once_stood_for_verifies_with_its_present_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blind search stands for the former ff-astar2: its plans say that they are optimal, so the two always differ."""
    run = read(simulated_log(tmp_path / "run.mcap", name="model-lios@sas-blind", task=TWO))
    plans = tuple(
        msgspec.structs.replace(plan, solver="sas-ff-astar2" if plan.solver == "sas-blind" else plan.solver)
        for plan in run.plans
    )
    info = msgspec.structs.replace(run.info, strategy="model-lios@sas-ff-astar2")
    old = replace(run, info=info, plans=plans)
    assert not verify(old).same
    monkeypatch.setitem(FORMER_SOLVERS, "sas-ff-astar2", "sas-blind")
    answer = verify(old)
    assert answer.same, answer.divergence
    assert "verified with sas-blind" in " ".join(answer.notes)


@pytest.mark.parametrize("solver", ["sas-ff-astar2", "sas-ff-astar"])
def test_a_log_of_the_papers_search_verifies_without_a_note(tmp_path: Path, solver: str) -> None:
    answer = verify(read(simulated_log(tmp_path / "run.mcap", name=f"model-lios@{solver}", task=TWO)))
    assert answer.same
    assert answer.notes == ()


def test_a_log_of_ones_own_planner_is_verified_by_the_name_under_which_it_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The log holds what the planner calls itself, rooms-first, which is installed nowhere here."""
    home = Path(__file__).resolve().parents[2] / "examples" / "own_planner" / "src"
    monkeypatch.syspath_prepend(home)
    monkeypatch.chdir(home)
    run = read(simulated_log(tmp_path / "run.mcap", name="own_planner:RoomsFirst"))
    run = replace(run, info=msgspec.structs.replace(run.info, strategy="rooms-first"))
    with pytest.raises(
        UnknownRecordedStrategy, match=r"'rooms-first', is not known here: .* Name it with --strategy"
    ):
        verify(run)
    with pytest.raises(UnknownRecordedStrategy):
        replan(run)
    assert verify(run, strategy_name="own_planner:RoomsFirst", origin=NameOrigin.USER).same
    assert not verify(run, strategy_name="opt-greedy").same


def test_a_skipped_container_is_named(tmp_path: Path) -> None:
    """What the robot never looked into, the strategy would have: the replay stops there."""
    run = read(simulated_log(tmp_path / "run.mcap", name="opt-greedy"))
    first = next(a for a in run.actions if a.action == "search")
    skipped = replace(
        run,
        observations=tuple(o for o in run.observations if o.container != first.target),
        actions=tuple(a for a in run.actions if not (a.action == "search" and a.target == first.target)),
    )
    divergence = verify(skipped).divergence
    assert divergence is not None
    assert divergence.decision == 1
    assert divergence.why == f"the strategy looks into {first.target}, which the robot skipped"


def test_an_operators_detour_is_named(tmp_path: Path) -> None:
    run = read(simulated_log(tmp_path / "run.mcap", name="opt-greedy"))
    first = run.actions[0]
    moved = msgspec.structs.replace(first, target=BED)
    divergence = verify(replace(run, actions=(moved, *run.actions[1:]))).divergence
    assert divergence is not None
    assert divergence.field == "target"
    assert "the robot did 'move Bed|2'" in divergence.why


def test_another_strategys_log_is_not_what_the_named_one_does(tmp_path: Path) -> None:
    """The hand-made run was not made by model-lios."""
    answer = verify(toy_run(tmp_path))
    assert not answer.same
    assert answer.divergence is not None


def test_of_a_log_that_is_cut_off_what_it_holds_is_compared(tmp_path: Path) -> None:
    run = read(simulated_log(tmp_path / "run.mcap", name="opt-greedy"))
    cut = replace(run, outcome=None, complete=False, actions=run.actions[:2], observations=run.observations[:2],
                  plans=run.plans[:1], beliefs=run.beliefs[:1], find_costs=run.find_costs[:1])  # fmt: skip
    answer = verify(cut)
    assert answer.same
    assert not answer.complete
    assert answer.decisions == 1
    assert not verify(read(killed_toy_log(tmp_path / "killed.mcap"))).complete


def test_the_oracle_needs_the_truth_to_be_verified(tmp_path: Path) -> None:
    with pytest.raises(Unsupported, match="no ground truth"):
        verify(read(simulated_log(tmp_path / "run.mcap", name="oracle", truth=False)))


def test_another_reckoning_of_the_same_step_is_told_from_another_step(tmp_path: Path) -> None:
    """Only the order of later looks differs, as after an improvement of the search: the robot does the same."""
    run = read(simulated_log(tmp_path / "run.mcap", name="model-lios"))
    first = run.plans[0]
    assert len(first.search_order) > 2
    turned = msgspec.structs.replace(first, search_order=(first.search_order[0], *first.search_order[:0:-1]))
    divergence = verify(replace(run, plans=(turned, *run.plans[1:]))).divergence
    assert divergence is not None
    assert divergence.field == "search_order"
    assert "the same next step from different figures" in divergence.why
    elsewhere = msgspec.structs.replace(first, search_order=first.search_order[::-1])
    divergence = verify(replace(run, plans=(elsewhere, *run.plans[1:]))).divergence
    assert divergence is not None
    assert "the strategy decides differently" in divergence.why
    assert "recorded by" in divergence.why


def test_words_for_people_are_not_compared(tmp_path: Path) -> None:
    run = read(simulated_log(tmp_path / "run.mcap", name="model-lios"))
    reworded = tuple(msgspec.structs.replace(plan, note="in other words") for plan in run.plans)
    assert verify(replace(run, plans=reworded)).same


@pytest.mark.parametrize("actions", [1, 4, 7])
def test_of_a_robots_run_that_was_stopped_what_was_recorded_is_compared(actions: int) -> None:
    """The strategy would have gone on; where a plan differs before the stop, that is still told."""
    whole = read(Path(__file__).parents[2] / "logs" / "spot-home-C.mcap")
    assert whole.outcome is not None
    assert len(whole.actions) > actions
    until = whole.actions[actions - 1]
    decided = [plan for plan in whole.plans if plan.decision <= until.decision]
    stopped = replace(
        whole,
        actions=whole.actions[:actions],
        observations=tuple(o for o in whole.observations if o.stamp <= until.stamp),
        plans=tuple(decided),
        beliefs=tuple(b for b in whole.beliefs if b.decision <= until.decision),
        find_costs=tuple(f for f in whole.find_costs if f.decision <= until.decision),
        outcome=msgspec.structs.replace(whole.outcome, status="aborted", reason="stopped by key"),
    )
    answer = verify(stopped)
    assert answer.divergence is None
    assert (answer.same, answer.complete, answer.stopped) == (True, True, "stopped by key")
    assert answer.decisions == len(decided)
    other = msgspec.structs.replace(stopped.actions[-1], target=BED)
    differs = verify(replace(stopped, actions=(*stopped.actions[:-1], other)))
    assert not differs.same
    assert differs.stopped == "stopped by key"
