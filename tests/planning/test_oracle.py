"""The oracle is the lower bound of every table, also where items that nobody has seen meet a part of the goal."""

from __future__ import annotations

from itertools import pairwise

import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_house

from recorders.simulated_run import Trial, trial_events
from workbench.execution.events import RunEnded
from workbench.execution.loop import outcome_of
from workbench.planning.strategies import STRATEGIES
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding, Task
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.maps.navigation import navigate


def stands(item_type: str, at: ContainerId) -> Delivered:
    return Delivered(item_type=ItemType(item_type), at=LocationId(at))


def run_of(goal: Goal, strategy: str) -> RunEnded:
    house = toy_house()
    types = tuple(sorted(house.item_types()))
    task = Task(scenario="own", goal=goal, failure_cost=400.0, budget_s=60.0, available=types)
    return outcome_of(list(trial_events(Trial(house=house, task=task, strategy=strategy, estimator="counts"))))


def metres(*places: str) -> float:
    travel = navigate(toy_house().plan).travel
    return sum(travel.between(LocationId(a), LocationId(b)) or 0.0 for a, b in pairwise(places))


GOALS: dict[str, Goal] = {
    "one of two is there": AnyOf(parts=(stands("Pillow", BED), stands("Plate", FRIDGE))),
    "cheap to bring, far to look": AnyOf(parts=(stands("Book", BED), stands("Plate", COUNTER))),
    "on the way": AllOf(parts=(stands("Pillow", BED), Delivered(item_type=ItemType("Pencil"), at=START))),
    "before the end": AllOf(parts=(stands("Egg", FRIDGE), stands("Bread", COUNTER))),
    "in hand at the end": AllOf(parts=(stands("Pillow", BED), Holding(item_type=ItemType("Plate"), at=START))),
    "where nothing is": AnyOf(parts=(stands("Mug", FRIDGE), stands("Mug", COUNTER), stands("Mug", TABLE))),
    "passed with a thing in hand": AllOf(
        parts=(
            stands("Bowl", TABLE),
            stands("Egg", TABLE),
            Holding(item_type=ItemType("Pencil"), at=LocationId(DESK)),
        )
    ),
}


@pytest.mark.ci_but(3)
@pytest.mark.parametrize("name", GOALS)
def test_nobody_is_cheaper_than_the_oracle(name: str) -> None:
    best = run_of(GOALS[name], "oracle")
    assert best.status == "done"
    for strategy in STRATEGIES:
        other = run_of(GOALS[name], strategy)
        assert other.status != "done" or other.cost >= best.cost - 1e-6, strategy


def test_only_places_that_hold_what_is_wanted_are_looked_into() -> None:
    """A mug stands on the counter; neither in the fridge nor on the table is one, though they are nearer."""
    best = run_of(GOALS["where nothing is"], "oracle")
    assert best.searches == 1
    assert best.cost == pytest.approx(metres(START, COUNTER))


def test_what_stands_there_is_seen_where_that_costs_least() -> None:
    """The egg in the fridge is looked at on the way to the table's bread, or after it; never by a second round."""
    best = run_of(GOALS["before the end"], "oracle")
    ways = [metres(START, FRIDGE, TABLE, COUNTER), metres(START, TABLE, FRIDGE, COUNTER)]
    ways.append(metres(START, TABLE, COUNTER, FRIDGE))
    assert best.cost == pytest.approx(min(ways) + 10)
