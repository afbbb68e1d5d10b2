"""Where a decision is the same whatever else open containers hold, the run is followed: both ends are reached with an
estimator that learns from all that is seen, and no other contents lead beyond them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from consistent_worlds import random_world, read_facts, run_in

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.decisions import same_decision
from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis
from replayers.counterfactual.decisions.same_decision import SameDecision, next_steps
from replayers.counterfactual.decisions.watched_belief import decide_watched, watched
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import in_truth, replay_on
from replayers.runs.run import read
from workbench.beliefs.belief import Belief
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.problem import missing_types
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import Task, goal_types
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses

HOUSE = 9


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    trial = trial_for(
        RequestedTask(scenario="deliver-3"),
        load_houses(shipped_houses())[HOUSE],
        strategy="pes-greedy",
        estimator="best",
        seed=0,
    )
    record_trial(trial, path)
    return path


@pytest.fixture(scope="module")
def prepared(log: Path) -> PreparedLog:
    return prepare_log(read(log), ReplaySettings(worlds=0))


@pytest.mark.parametrize("name", ["opt-lios", "model-lios"])
def test_ends_are_reached_that_no_other_contents_exceed(log: Path, prepared: PreparedLog, name: str) -> None:
    assert not prepared.static_beliefs
    bounds = replay_on(prepared, name).bounds
    assert bounds is not None
    assert bounds.lower_proof == bounds.upper_proof == "exact"
    assert bounds.lower < bounds.upper
    facts, rng = read_facts(log), np.random.default_rng(3)
    costs = [run_in(facts, random_world(facts, rng, extra=extra), name).cost for extra in (0, 5, 20, 60, 200)]
    assert all(bounds.lower - NEAR_COST <= cost <= bounds.upper + NEAR_COST for cost in costs)


def test_a_strategy_that_may_not_be_asked_again_is_not_followed_as_far(
    log: Path, prepared: PreparedLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = prepare_log(read(log), ReplaySettings(worlds=0, budget=Budget(asked_again=0)))
    few, all_ = replay_on(asked, "model-lios"), replay_on(prepared, "model-lios")
    assert few.bounds is not None
    assert all_.bounds is not None
    assert few.if_beliefs_stand is not None
    assert few.bounds.lower <= all_.bounds.lower
    assert few.bounds.upper > all_.bounds.upper
    monkeypatch.setattr(same_decision, "MAX_ROWS", 1)
    fewer = replay_on(prepare_log(read(log), ReplaySettings(worlds=0)), "opt-lios")
    assert fewer.if_beliefs_stand is not None


class Noting:
    """A strategy that keeps the views by which it decided, with what it decided."""

    def __init__(self, planner: Strategy) -> None:
        self.name = planner.name
        self.made: list[tuple[View, Decision]] = []
        self._planner = planner

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return self._planner.relevant_types(task)

    def decide(self, view: View) -> Decision:
        self.made.append((view, self._planner.decide(view)))
        return self.made[-1][1]


def views_in_truth(log: Path, planner: Strategy) -> list[tuple[View, Decision]]:
    """The views of a run in the recorded truth, those with something left to search, each with its decision."""
    noting = Noting(planner)
    in_truth(prepare_log(read(log, with_truth=True), ReplaySettings(worlds=0, with_truth=True)), noting)
    return [(view, made) for view, made in noting.made if len(view.belief.containers)]


def with_rows(view: View, types: Iterable[ItemType], chance: float) -> View:
    """The view with another belief about some types."""
    probability = view.belief.probability.copy()
    probability[[view.belief.item_types.index(t) for t in types]] = chance
    return replace(view, belief=replace(view.belief, probability=probability))


STRATEGIES = ["opt-lios", "model-lios", "conditioned-lios", "full-lios", "scout-lios"]


@pytest.mark.parametrize("name", STRATEGIES)
def test_beliefs_that_a_strategy_does_not_read_change_no_decision(log: Path, name: str) -> None:
    planner, compared = strategy(name), 0
    for view, made in views_in_truth(log, planner):
        again, read_rows = decide_watched(planner, view)
        assert next_steps(again) == next_steps(made)
        others = set(view.belief.item_types) - set(read_rows)
        for chance in (0.0, 0.9) if others else ():
            assert next_steps(planner.decide(with_rows(view, others, chance))) == next_steps(made)
            compared += 1
    assert compared > 1


def test_beliefs_about_what_is_found_are_read_by_one_that_simulates_and_change_what_it_does(log: Path) -> None:
    """Asked again with other beliefs about what is missing alone, it would seem to do the same whatever it sees."""
    scout, read_of_found, changed = strategy("scout-lios"), 0, 0
    for view, made in views_in_truth(log, scout):
        missing = missing_types(view.task.goal, view.knowledge, view.task.available)
        found = set(decide_watched(scout, view)[1]) - set(missing)
        read_of_found += bool(found)
        changed += any(next_steps(scout.decide(with_rows(view, found, p))) != next_steps(made) for p in (0.0, 0.9))
    assert read_of_found
    assert changed
    for name in ("opt-lios", "model-lios"):
        for view, _ in views_in_truth(log, strategy(name)):
            missing = missing_types(view.task.goal, view.knowledge, view.task.available)
            assert set(decide_watched(strategy(name), view)[1]) <= set(missing)


class Beliefs:
    """An estimator with two possible beliefs about each type that it is asked about."""

    name = "two"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        return self._belief(knowledge, item_types, 0.5)

    def beliefs_whatever_else(
        self,
        knowledge: Knowledge,
        item_types: tuple[ItemType, ...],
        partly_known: Collection[ContainerId],
        *,
        at_most: int,
    ) -> tuple[Belief, ...] | None:
        assert partly_known
        return tuple(self._belief(knowledge, item_types, p) for p in (0.5, 0.25)) if at_most > 1 else None

    def _belief(self, knowledge: Knowledge, item_types: tuple[ItemType, ...], chance: float) -> Belief:
        containers = knowledge.unsearched
        rows = np.full((len(item_types), len(containers)), chance)
        return Belief(item_types=item_types, containers=containers, probability=rows, estimator=self.name)


class Reading:
    """A strategy that looks into the first container, or into the second by what it reads of its belief."""

    name = "reading"

    def __init__(self, reads: Callable[[Belief], bool]) -> None:
        self._reads = reads

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return goal_types(task.goal)

    def decide(self, view: View) -> Decision:
        which = view.belief.containers[int(self._reads(view.belief))]
        return Decision(plan=Plan(status=PlanStatus.SOLVED), look_on_the_way=(LocationId(which),))


def row(belief: Belief, number: int) -> float:
    return float(belief.of(belief.item_types[number])[0])


@pytest.mark.parametrize(
    ("reads", "settled", "holds"),
    [
        (lambda _: False, (), True),
        (lambda belief: row(belief, 0) > 1, (0,), True),
        (lambda belief: row(belief, 0) > 0.3, (0,), False),
        (lambda belief: row(belief, 0) > 1, (1,), False),  # of which the containers may hold anything
        (lambda belief: row(belief, 0) < 0.3 and row(belief, 1) > 1, (0, 1), False),  # read by another belief alone
        (lambda belief: row(belief, 0) + row(belief, 1) > 1.6, (0, 1), True),
        (lambda belief: bool(belief.probability[0, 0] > 1), (0, 1), False),  # of all rows, one is of a third type
    ],
)
def test_a_decision_is_shared_only_if_every_row_that_it_read_was_varied(
    prepared: PreparedLog, log: Path, reads: Callable[[Belief], bool], settled: tuple[int, ...], holds: bool
) -> None:
    start, _ = views_in_truth(log, strategy("opt-greedy"))[0]
    opened = prepared.evidence.open[0]
    knowledge = start.knowledge.seen(opened, ())
    types = start.belief.item_types
    planner, estimator = Reading(reads), Beliefs()
    view = replace(start, knowledge=knowledge, belief=estimator.believe(knowledge, types))
    made, read_rows = decide_watched(planner, view)
    same = SameDecision(
        planner,
        estimator,
        [opened],
        lambda _: tuple(types[k] for k in settled),
        policy=None,
        parts=None,
        at_most=10,
    )
    assert same.holds(DecisionBasis(view=view, read=read_rows), made) is holds
    unopened = SameDecision(planner, estimator, [], lambda _: (), policy=None, parts=None, at_most=10)
    assert unopened.holds(DecisionBasis(view=view, read=read_rows), made)


def test_a_watched_belief_notes_the_rows_that_are_handed_out(log: Path) -> None:
    view, _ = views_in_truth(log, strategy("opt-greedy"))[0]
    belief, (first, second, *_) = view.belief, view.belief.item_types
    for take, noted in (
        (lambda b: b.containers, set[ItemType]()),
        (lambda b: b.of(first), {first}),
        (lambda b: b.only((second, ItemType("Unheard"))), {second}),
        (lambda b: b.only(b.item_types), set(belief.item_types)),
        (lambda b: b.probability, set(belief.item_types)),
        (lambda b: replace(b, estimator="other"), set(belief.item_types)),
    ):
        one = watched(belief)
        assert one.read == set()
        take(one)
        assert one.read == noted
    np.testing.assert_array_equal(watched(belief).of(first), belief.of(first))
    np.testing.assert_array_equal(watched(belief).only((second,)).probability, belief.only((second,)).probability)


def test_one_that_simulates_is_followed_further_and_nothing_leads_beyond(log: Path, prepared: PreparedLog) -> None:
    few = prepare_log(read(log), ReplaySettings(worlds=0, budget=Budget(asked_again=0)))
    bounds, without = replay_on(prepared, "scout-lios").bounds, replay_on(few, "scout-lios").bounds
    assert bounds is not None
    assert without is not None
    assert bounds.lower > without.lower
    facts, rng = read_facts(log), np.random.default_rng(5)
    for extra in (0, 5, 20, 60):
        cost = run_in(facts, random_world(facts, rng, extra=extra), "scout-lios").cost
        assert bounds.lower - NEAR_COST <= cost <= bounds.upper + NEAR_COST
