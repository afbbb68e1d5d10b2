"""What is called exact is what the strategy costs: beliefs to the last bit, old logs that round them, known ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from toy import BED, COUNTER, DESK, TABLE
from toy_logs import MUG, InOrder, delivered, simulated_log, task_of, toy_run

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.counterfactual import reproduction
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.logged_belief import LoggedBelief
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log, run_tree_of
from replayers.counterfactual.replay import replay_on, replay_strategy
from replayers.counterfactual.reproduction import Reproduction, reproduce
from replayers.counterfactual.results import Proof
from replayers.counterfactual.single_runs import over_log_by_tree
from replayers.runs.run import Run, read
from workbench.beliefs.belief import Belief
from workbench.execution.events import BeliefUpdated, Event, RunStatus
from workbench.log_schema.codec import decode, encode, to_wire
from workbench.log_schema.events import BeliefUpdate, Outcome
from workbench.planning.strategies import strategy
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses


def rounded_log(folder: Path, *, estimator: str = "mine@0", name: str = "model-lios") -> Run:
    """A run as an older release would have written it, by an estimator that is not here."""
    run = read(simulated_log(folder / "run.mcap", name=name))
    info = msgspec.structs.replace(run.info, schema_version=2, estimator=estimator or run.info.estimator)
    beliefs = tuple(
        msgspec.structs.replace(b, probability=tuple(tuple(round(p, 6) for p in row) for row in b.probability))
        for b in run.beliefs
    )
    return replace(run, info=info, beliefs=beliefs)


def with_cost(run: Run, cost: float) -> Run:
    assert run.outcome is not None
    return replace(run, outcome=msgspec.structs.replace(run.outcome, cost=cost, own_cost=run.outcome.own_cost))


def test_beliefs_are_written_to_the_last_bit() -> None:
    probability = np.random.default_rng(0).random((2, 3))
    belief = Belief(
        item_types=(ItemType("Mug"), ItemType("Book")),
        containers=(ContainerId("a"), ContainerId("b"), ContainerId("c")),
        probability=probability,
        estimator="x",
    )
    (wire,) = to_wire(BeliefUpdated(stamp_ns=1, decision=1, belief=belief))
    read_again = decode("/search/belief", encode(wire))
    assert isinstance(read_again, BeliefUpdate)
    assert np.array_equal(np.array(read_again.probability), probability)


@pytest.mark.parametrize("grasps", [2, 3])
def test_grasps_that_failed_are_tried_again_as_they_were(tmp_path: Path, grasps: int) -> None:
    """Two failed grasps and one that held, or three that failed: the item was never lost."""
    task = task_of(delivered(MUG, BED))
    log = simulated_log(tmp_path / "run.mcap", task=task, refuse={("pick", "Mug|1"): grasps, ("pick", "Mug|2"): 9})
    run = read(log)
    run = replace(run, info=msgspec.structs.replace(run.info, source="spot"))
    assert run.outcome is not None
    picks = [action for action in run.actions if action.action == "pick"]
    assert [pick.success for pick in picks][:grasps] == [False] * grasps
    prepared = prepare_log(run, ReplaySettings(worlds=0))
    result = replay_on(prepared, run.info.strategy)
    assert result.cost == pytest.approx(run.outcome.cost)


def test_an_old_log_is_replayed_with_the_estimator_that_it_names_where_that_is_here(tmp_path: Path) -> None:
    run = rounded_log(tmp_path, estimator="")
    prepared = prepare_log(run, ReplaySettings(worlds=0))
    assert not isinstance(prepared.estimator, LoggedBelief)
    assert prepared.estimator.name == run.info.estimator
    assert prepared.exact_beliefs
    assert not any("rounds" in note for note in prepared.notes)


def test_rounded_beliefs_make_nothing_exact_that_goes_by_them(tmp_path: Path) -> None:
    """Other strategies that read beliefs get bounds that hold whatever is believed; those of the rounded ones stand
    apart. Greedy goes by distance alone, and the strategy that drove the run did what was recorded."""
    run = rounded_log(tmp_path)
    prepared = prepare_log(run, ReplaySettings(worlds=20))
    assert any("rounds beliefs to six decimals" in note for note in prepared.notes)
    other = replay_on(prepared, "pes-lios")
    assert other.bounds is not None
    assert not other.exact
    assert Proof.EXACT not in (other.bounds.lower_proof, other.bounds.upper_proof)
    assert other.if_beliefs_stand is not None
    assert other.bounds.lower <= other.if_beliefs_stand.lower
    assert other.if_beliefs_stand.upper <= other.bounds.upper
    plain = replay_on(prepare_log(read(run.path), ReplaySettings(worlds=20)), "opt-greedy")
    assert replay_on(prepared, "opt-greedy").bounds == plain.bounds
    drove = replay_on(prepared, "model-lios")
    assert run.outcome is not None
    assert drove.exact
    assert drove.cost is not None
    assert abs(drove.cost - run.outcome.cost) <= NEAR_COST


def test_a_recorded_cost_that_does_not_come_again_leaves_no_claim(tmp_path: Path) -> None:
    run = read(simulated_log(tmp_path / "run.mcap"), with_truth=True)
    assert run.outcome is not None
    prepared = prepare_log(with_cost(run, run.outcome.cost + 0.5), ReplaySettings(worlds=20, with_truth=True))
    for name in ("model-lios", "opt-greedy", "oracle"):
        made = replay_on(prepared, name)
        assert made.status is RunStatus.NOT_REPRODUCED
        assert (made.bounds, made.estimate, made.drawn, made.true_cost, made.cost) == (None,) * 5
        assert "0.50" in made.reason or "where the run cost" in made.reason
        assert made.reason in made.notes
    assert replay_strategy(prepared, InOrder((TABLE, COUNTER))).status is RunStatus.NOT_REPRODUCED
    assert isinstance(run.outcome, Outcome)


def test_beliefs_that_somebody_asked_for_are_said_to_be_others(tmp_path: Path) -> None:
    """With other beliefs than the run's the recorded strategy need not do what it did: a note, and figures."""
    run = read(simulated_log(tmp_path / "run.mcap"))
    assert run.outcome is not None
    prepared = prepare_log(with_cost(run, run.outcome.cost + 0.5), ReplaySettings(worlds=0, estimator="fcnn"))
    made = replay_on(prepared, "opt-greedy")
    assert made.bounds is not None
    assert any("itself does not do what was recorded" in note for note in made.notes)


def test_the_dearest_world_that_was_drawn_is_known(tmp_path: Path) -> None:
    """Nothing is followed for the bounds, so that drawn worlds alone have ends: the written ones are those."""
    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=200, budget=Budget(segments=0, finish=0)))
    made = replay_strategy(prepared, InOrder((BED, DESK, TABLE, COUNTER)), worlds=("best", "worst"))
    assert made.bounds is not None
    assert made.drawn is not None
    assert made.bounds.least_found == made.drawn.min()
    assert made.bounds.largest_found == made.drawn.max()
    costs = {name: events[-1].cost for name, events in made.worlds.items()}  # type: ignore[union-attr]
    assert costs == {"best": made.drawn.min(), "worst": made.drawn.max()}


def test_a_plain_log_is_reproduced_by_the_tree_of_its_strategy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No closed loop; the replay of that strategy takes the tree over, and says the same as one with a new tree."""
    run = read(simulated_log(tmp_path / "run.mcap"))
    with monkeypatch.context() as looped:
        looped.setattr(PreparedLog, "is_plain", False)
        assert prepare_log(run, ReplaySettings(worlds=0)).reproduction == Reproduction(same=True, whole=True)
    monkeypatch.setattr(reproduction, "run_task", None)
    prepared = prepare_log(run, ReplaySettings(worlds=0), with_paths=False)
    assert prepared.reproduction == Reproduction(same=True, whole=True)
    kept = prepared.driven.find("model-lios")
    assert kept is not None
    assert run_tree_of(prepared, strategy("opt-greedy")) is not kept.tree
    assert run_tree_of(replace(prepared, evidence=replace(prepared.evidence)), kept.planner) is not kept.tree
    first, again = replay_on(prepared, "model-lios"), replay_on(prepared, "model-lios")
    assert len(prepared.driven) == 0
    assert kept.tree.segments == first.segments
    assert (again.bounds, again.events[-1], again.segments) == (first.bounds, first.events[-1], first.segments)


def test_a_log_whose_looks_showed_something_else_is_reproduced_by_the_closed_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a container held is all that a tree knows of it; the loop shows what each look showed."""
    run = read(simulated_log(tmp_path / "run.mcap"))
    prepared = prepare_log(run, ReplaySettings(worlds=0), with_paths=False)
    told = over_log_by_tree(prepared, run_tree_of(prepared, strategy("model-lios")))
    looped: list[Run] = []

    def in_loop(run: Run, *_: object) -> Iterator[Event]:
        looped.append(run)
        return iter(told)

    monkeypatch.setattr(reproduction, "events_over", in_loop)
    evidence = prepared.evidence
    assert reproduce(run, evidence, prepared.estimator, by_tree=lambda _: told).whole
    assert looped == []
    turned = {container: tuple(items[::-1] for items in looks) for container, looks in evidence.looks.items()}
    assert reproduce(run, replace(evidence, looks=turned), prepared.estimator, by_tree=lambda _: told).whole
    assert looped == [run]


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["fcnn", "counts", "best"])
@pytest.mark.parametrize("name", ["model-lios", "scout-lios"])
def test_a_run_is_replayed_over_its_own_log_at_its_own_cost(tmp_path: Path, name: str, estimator: str) -> None:
    """Whole houses; with beliefs rounded to six decimals, model-lios by fcnn did otherwise in the first of them."""
    for index in range(3):
        house = load_house(f"{shipped_houses()}:{index}")
        path = tmp_path / f"{index}.mcap"
        end = record_trial(
            trial_for(RequestedTask(scenario="deliver-3"), house, strategy=name, estimator=estimator), path
        )
        made = replay_on(prepare_log(read(path), ReplaySettings(worlds=0)), name)
        assert made.exact
        assert made.cost == pytest.approx(end.cost, abs=1e-6)
