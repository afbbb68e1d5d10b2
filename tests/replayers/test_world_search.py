"""Strategies that decide alike share the search of the worlds, and find what each would find alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from toy_logs import BOOK, MUG, InOrder, delivered

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.counterfactual.bounds import branch_and_bound
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import Replay, replay_on, replay_strategy, run_tree_of
from replayers.counterfactual.results import Proof
from replayers.counterfactual.strategy_traits import decision_kind
from replayers.runs.run import Run, read
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import LocationId
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses

LOGS = Path(__file__).parents[2] / "logs"
ALIKE = (("opt-greedy", "pes-greedy"), ("opt-lios", "pes-lios"))
"""Strategies that differ by a constant for each find."""
FEW = ReplaySettings(worlds=20, budget=Budget(segments=40, draws=20))
TABLE = "table"


def findings(made: Replay) -> tuple[object, ...]:
    """What the search of the worlds tells of a replay."""
    assert made.bounds is not None
    assert made.drawn is not None
    ends = made.bounds.cheapest, made.bounds.most_expensive
    return (made.bounds.figures, made.bounds.groups, ends, made.estimate, made.segments, made.asked, made.notes,
            tuple(made.drawn.tolist()))  # fmt: skip


def assert_together_as_alone(run: Run, names: tuple[str, str], settings: ReplaySettings) -> None:
    shared = prepare_log(run, settings)
    together = [replay_on(shared, name) for name in names]
    alone = [replay_on(prepare_log(run, settings), name) for name in names]
    assert len(shared.searched) == 1
    assert [made.strategy for made in together] == list(names)
    for one, other in zip(together, alone, strict=True):
        assert findings(one) == findings(other)
        assert repr(one.events) == repr(other.events)


@pytest.mark.parametrize("log", ["deliver-3", "find-greedy", "spot-home-B"])
@pytest.mark.parametrize("names", ALIKE)
def test_strategies_that_decide_alike_find_together_what_each_finds_alone(log: str, names: tuple[str, str]) -> None:
    assert_together_as_alone(read(LOGS / f"{log}.mcap"), names, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("house", range(0, 24, 3))
def test_so_it_is_in_many_houses(tmp_path: Path, house: int) -> None:
    trial = trial_for(
        RequestedTask(scenario="deliver-3"),
        load_house(f"{shipped_houses()}:{house}"),
        strategy="model-lios",
        estimator="counts",
    )
    record_trial(trial, tmp_path / "run.mcap")
    for names in ALIKE:
        assert_together_as_alone(read(tmp_path / "run.mcap"), names, ReplaySettings(worlds=20))


@pytest.mark.parametrize(
    ("goal", "alike"),
    [
        (Holding(item_type=MUG, at=LocationId(TABLE)), True),
        (delivered(MUG, TABLE), True),
        (AllOf(parts=(delivered(MUG, TABLE), delivered(BOOK, TABLE))), True),
        (AllOf(parts=(delivered(MUG, TABLE), delivered(MUG, "desk"))), False),
        (AllOf(parts=(Delivered(item_type=MUG, at=LocationId(TABLE), properties=("boiled",)),)), False),
        (AnyOf(parts=(delivered(MUG, TABLE), delivered(BOOK, TABLE))), False),
    ],
)
def test_a_constant_for_each_find_changes_nothing_where_every_plan_has_as_many(goal: Goal, alike: bool) -> None:
    for names in ALIKE:
        one, other = (decision_kind(strategy(name), goal) for name in names)
        assert (one is not None) == alike
        assert one == other
    assert decision_kind(strategy("opt-greedy"), goal) != decision_kind(strategy("opt-lios"), goal) or not alike
    assert decision_kind(strategy("model-lios"), goal) is None
    assert decision_kind(InOrder(()), goal) is None


def test_a_search_that_began_otherwise_is_not_shared() -> None:
    """As if two strategies of one kind went different ways: each has bounds of its own."""
    prepared = prepare_log(read(LOGS / "find-greedy.mcap"), FEW)
    goal = prepared.evidence.task.goal
    other = replay_on(prepared, "opt-lios")
    found = prepared.searched.find((decision_kind(strategy("opt-lios"), goal), True, False))
    assert found is not None
    prepared.searched.put((decision_kind(strategy("opt-greedy"), goal), True, False), found)
    made = replay_strategy(prepared, strategy("opt-greedy"))
    alone = replay_on(prepare_log(read(LOGS / "find-greedy.mcap"), FEW), "opt-greedy")
    assert findings(made) == findings(alone)
    assert findings(made) != findings(other)


def test_a_search_that_is_nearly_done_goes_on_beyond_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """172 segments settle both ends; a budget of 130 would end at 128, with few branches left."""
    prepared = prepare_log(read(LOGS / "deliver-3.mcap"), ReplaySettings(worlds=0), with_paths=False)
    budget, planner = Budget(segments=130, finish=0), strategy("conditioned-lios")
    nearly = bounds_of(run_tree_of(prepared, planner), budget=budget)
    monkeypatch.setattr(branch_and_bound, "NEARLY_DONE", -1.0)
    strict = bounds_of(run_tree_of(prepared, planner), budget=budget)
    assert nearly.upper_proof is Proof.EXACT
    assert budget.segments < nearly.segments <= 2 * budget.segments
    assert strict.upper_proof is not Proof.EXACT
    assert strict.segments <= budget.segments
    assert strict.upper >= nearly.upper == nearly.largest_found >= strict.largest_found
