"""The memory experiment on tasks: five earlier tasks in a house, then one more with and without memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from workbench.beliefs.memory.memory import Memory, PastLook, remember
from workbench.beliefs.memory.move_rates import NS_PER_DAY, MoveRates
from workbench.errors import LiosError
from workbench.evaluation.failed_estimator import ESTIMATOR_FAULTS
from workbench.evaluation.memory.conditions import CONDITIONS, EARLIER_RUNS, HOUR_NS, MemoryCondition, MemoryCost
from workbench.evaluation.moved_house import moved_house
from workbench.evaluation.tasks.trials import TrialKey, house_of
from workbench.execution.events import ContainerObserved, RunEnded
from workbench.execution.setup import set_up
from workbench.execution.start import TaskStart, scenario_start
from workbench.planning.actions import relevant_types
from workbench.planning.scenarios.house_items import ScenarioUnsupported
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.worlds.house import House
from workbench.worlds.maps.navigation import Navigation
from workbench.worlds.simulated import EPOCH_NS, SimulatedWorld

EARLIER_STRATEGY = "conditioned-lios"
"""The strategy of the earlier runs."""
ATTEMPTS = 50
"""Seeds tried until a house supports the scenario."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryTasks:
    """The settings of the experiment: strategies, and the estimator of all of them, with and without memory."""

    strategies: tuple[str, ...]
    rates: MoveRates
    estimator: str = "best"
    assets: Path | None = None
    costs: ActionCosts = SIMULATION_COSTS
    conditions: tuple[MemoryCondition, ...] = CONDITIONS


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryTrial:
    """The results of one trial, or why there are none."""

    house: str
    costs: tuple[MemoryCost, ...]
    skipped: str = ""


def remembered_tasks(keys: Sequence[TrialKey], settings: MemoryTasks) -> Iterator[MemoryTrial]:
    """Every condition and strategy, trial by trial; a trial's draws depend on its key alone."""
    for key in keys:
        house, navigation = house_of(key.houses, key.house_index, settings.assets)
        try:
            costs = tuple(_trial(key, house, navigation, settings))
        except ESTIMATOR_FAULTS:
            raise
        except LiosError as error:
            yield MemoryTrial(house=house.plan.name, costs=(), skipped=str(error))
        else:
            yield MemoryTrial(house=house.plan.name, costs=costs)


def _trial(key: TrialKey, house: House, navigation: Navigation, settings: MemoryTasks) -> Iterator[MemoryCost]:
    history = [look for number in range(EARLIER_RUNS) for look in _earlier(key, house, navigation, settings, number)]
    for condition in settings.conditions:
        rng = np.random.default_rng((key.seed, 1))
        now = moved_house(house, navigation.travel, condition.moved, rng=rng)
        start = _start(key.scenario, now, navigation, seed=key.seed)
        memory = remember(history, at_ns=EPOCH_NS + round(condition.days * NS_PER_DAY), rates=settings.rates)
        current = replace(start, known=tuple(dict.fromkeys((*start.known, *memory.by_container))))
        seen = {item_type for look in memory.looks for item_type in look.item_types}
        oracle = _cost("oracle", start, navigation, settings, key.seed, None)
        for name in settings.strategies:
            yield MemoryCost(
                condition=condition.name,
                strategy=name,
                house=house.plan.name,
                known=seen.issuperset(relevant_types(start.task.goal)),
                without=_cost(name, start, navigation, settings, key.seed, None),
                remembered=_cost(name, start, navigation, settings, key.seed, memory),
                oracle=oracle,
                up_to_date=_cost(name, current, navigation, settings, key.seed, None),
            )


def _earlier(
    key: TrialKey, house: House, navigation: Navigation, settings: MemoryTasks, number: int
) -> Iterator[PastLook]:
    """What an earlier task saw, and what was known at its start."""
    start = _start(key.scenario, house, navigation, seed=(key.seed + 1000 * (number + 1)) % 2**63)
    for event in _events(EARLIER_STRATEGY, start, navigation, settings, key.seed, None):
        if isinstance(event, ContainerObserved):
            yield PastLook(
                container=event.container,
                seen_ns=EPOCH_NS + number * HOUR_NS,
                item_types=tuple(sorted({item.type for item in event.items})),
                run=f"earlier {number + 1}",
            )


def _start(scenario: str, house: House, navigation: Navigation, *, seed: int) -> TaskStart:
    for attempt in range(ATTEMPTS):
        try:
            return scenario_start(scenario, house, seed=(seed + attempt) % 2**63, travel=navigation.travel)
        except ScenarioUnsupported:
            if attempt == ATTEMPTS - 1:
                raise
    raise AssertionError("unreachable")


def _cost(
    name: str, start: TaskStart, navigation: Navigation, settings: MemoryTasks, seed: int, memory: Memory | None
) -> float:
    ended = [e for e in _events(name, start, navigation, settings, seed, memory) if isinstance(e, RunEnded)]
    return ended[-1].cost


def _events(
    name: str, start: TaskStart, navigation: Navigation, settings: MemoryTasks, seed: int, memory: Memory | None
):
    setup = set_up(
        start.task,
        strategy=name,
        estimator=settings.estimator,
        costs=settings.costs,
        seed=seed % 2**31,
        house=start.house,
        memory=memory,
    )
    return setup.events(SimulatedWorld(start.house, navigation, known=start.known))
