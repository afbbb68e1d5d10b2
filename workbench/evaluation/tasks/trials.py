"""Task trials: one task in one house by one strategy, reduced to a row of results.

A trial's house, task, start and seed depend only on its scenario and number, so that every strategy gets the same
trials and costs can be compared pairwise, independent of the execution order.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from workbench.beliefs.belief import Estimator
from workbench.beliefs.estimators import estimator as estimator_named
from workbench.errors import LiosError
from workbench.evaluation.failed_estimator import require_beliefs
from workbench.evaluation.tasks.rows import TaskRow
from workbench.execution.events import Event, PlanMade, RunEnded
from workbench.execution.setup import set_up
from workbench.execution.start import scenario_start
from workbench.planning.plans import PlanStatus
from workbench.planning.scenarios.house_items import ScenarioUnsupported
from workbench.planning.strategies import needs_truth
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.worlds.house import ContainerId, House
from workbench.worlds.maps.navigation import Navigation, navigate
from workbench.worlds.perception import missing_at
from workbench.worlds.procthor.load import load_house
from workbench.worlds.sight.sightings import sight_paths
from workbench.worlds.simulated import SimulatedWorld


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialKey:
    """The key of a trial: scenario, number, house file and index, and the seed of task, start and strategy."""

    scenario: str
    trial: int
    houses: str
    house_index: int
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedTrial:
    """A prepared trial: everything but the strategy.

    Attributes:
        miss_rate: the chance that a look misses an item, drawn alike for every strategy; the oracle's never miss.
        sees_m: how far the robot sees open furniture in passing, in metres; 0 for not at all.
    """

    key: TrialKey
    house: House
    navigation: Navigation
    task: Task
    known: tuple[ContainerId, ...]
    costs: ActionCosts
    miss_rate: float = 0.0
    sees_m: float = 0.0

    def misses_of(self, strategy: str | Strategy) -> float:
        """The chance that a look of a run with that strategy misses an item."""
        return 0.0 if isinstance(strategy, str) and needs_truth(strategy) else self.miss_rate

    def events(self, strategy: str | Strategy, estimator: str | Estimator) -> Iterator[Event]:
        """Run it in simulation.

        Raises:
            UnknownName, PluginNotLoaded: as set_up.
        """
        rate = self.misses_of(strategy)
        setup = set_up(
            self.task,
            strategy=strategy,
            estimator=estimator,
            costs=self.costs,
            seed=self.key.seed % 2**31,
            house=self.house,
            perception=missing_at(rate),
        )
        world = SimulatedWorld(
            self.house,
            self.navigation,
            known=self.known,
            miss_rate=rate,
            seed=self.key.seed,
            passing=sight_paths(self.house.plan, self.navigation.travel, self.navigation, self.sees_m),
        )
        return setup.events(world)


EventHook = Callable[[PreparedTrial, str, Estimator, Iterator[Event]], Iterator[Event]]
"""A hook on the events of a run: (trial, strategy name as in its row, estimator, events) -> the same events."""


def trial_seed(scenario: str, trial: int, seed: int) -> int:
    """A separate seed for every trial of every scenario: 63 bits of a hash."""
    text = f"{scenario}/{trial}/{seed}".encode()
    return int.from_bytes(hashlib.sha256(text).digest()[:8], "big") >> 1


def supported_houses(
    scenario: str, houses: str, indices: tuple[int, ...], *, assets: Path | None = None, seed: int = 0
) -> tuple[tuple[int, ...], tuple[ScenarioUnsupported, ...]]:
    """The houses that support a scenario, and the reason for each of the others."""
    fine: list[int] = []
    refused: list[ScenarioUnsupported] = []
    for index in indices:
        try:
            house, navigation = house_of(houses, index, assets)
            scenario_start(scenario, house, seed=seed, travel=navigation.travel)
            fine.append(index)
        except ScenarioUnsupported as refusal:
            refused.append(refusal)
    return tuple(fine), tuple(refused)


def trial_keys(
    scenario: str, houses: str, indices: tuple[int, ...], *, trials: int, seed: int
) -> tuple[TrialKey, ...]:
    """The trials of a scenario: houses in turn, in an order drawn from the seed."""
    if not indices:
        return ()
    rng = np.random.default_rng((seed, int.from_bytes(scenario.encode()[:6], "big")))
    order = [indices[int(i)] for i in rng.permutation(len(indices))]
    return tuple(
        TrialKey(
            scenario=scenario,
            trial=trial,
            houses=houses,
            house_index=order[trial % len(order)],
            seed=trial_seed(scenario, trial, seed),
        )
        for trial in range(trials)
    )


def prepare_trial(
    key: TrialKey,
    *,
    assets: Path | None = None,
    costs: ActionCosts = SIMULATION_COSTS,
    miss_rate: float = 0.0,
    sees_m: float = 0.0,
) -> PreparedTrial:
    """The trial's house, task and start.

    Whether a house supports a scenario may depend on the seed (items added by Coffee may be unreachable); then
    further seeds are tried, at most 50.

    Raises:
        ScenarioUnsupported: no seed works.
    """
    house, navigation = house_of(key.houses, key.house_index, assets)
    for attempt in range(50):
        seed = (key.seed + attempt) % 2**63
        try:
            start = scenario_start(key.scenario, house, seed=seed, travel=navigation.travel)
        except ScenarioUnsupported:
            if attempt == 49:
                raise
            continue
        return PreparedTrial(
            key=key,
            house=start.house,
            navigation=navigation,
            task=start.task,
            known=start.known,
            costs=costs,
            miss_rate=miss_rate,
            sees_m=sees_m,
        )
    raise AssertionError("unreachable")


def run_trial(trial: PreparedTrial, strategy: str, *, estimator: str, event_hook: EventHook | None = None) -> TaskRow:
    """Run one trial with one strategy. An error in the strategy becomes a row with status "error" and does not stop
    other trials.

    Raises:
        RunWithoutBeliefs: the estimator failed.
    """
    planned: list[PlanMade] = []
    ended: RunEnded | None = None
    resolved = estimator_named(estimator, origin=NameOrigin.USER)
    try:
        events = trial.events(strategy, resolved)
        for event in event_hook(trial, strategy, resolved, events) if event_hook else events:
            if isinstance(event, PlanMade):
                planned.append(event)
            elif isinstance(event, RunEnded):
                ended = event
    except LiosError:
        raise
    except Exception as error:  # noqa: BLE001  a user's strategy may raise anything; the other trials go on
        return _row(trial, strategy, resolved, planned, None, f"{type(error).__name__}: {error}")
    if ended is not None:
        require_beliefs(ended)
    return _row(trial, strategy, resolved, planned, ended, "no end")


def _row(
    trial: PreparedTrial,
    strategy: str,
    resolved: Estimator,
    planned: list[PlanMade],
    ended: RunEnded | None,
    why: str,
) -> TaskRow:
    solved = [p for p in planned if p.made.plan.status is PlanStatus.SOLVED]
    return TaskRow(
        scenario=trial.key.scenario,
        strategy=strategy,
        estimator=resolved.name,
        trial=trial.key.trial,
        house=trial.house.plan.name,
        house_index=trial.key.house_index,
        seed=trial.key.seed,
        status=str(ended.status) if ended else "error",
        success=ended is not None and str(ended.status) == "done",
        cost=ended.cost if ended else trial.task.failure_cost,
        own_cost=ended.own_cost if ended else 0.0,
        searches=ended.searches if ended else 0,
        travel_m=ended.travel_m if ended else 0.0,
        decisions=len(planned),
        predicted_cost=solved[0].made.plan.cost if solved else None,
        optimal=sum(p.made.plan.optimal for p in solved) / max(len(solved), 1),
        reason=ended.reason if ended else why,
        title=trial.task.title,
        containers=len(trial.house.plan.containers),
        belief_s=tuple(p.belief_s for p in planned),
        planning_s=tuple(p.planning_s for p in planned),
    )


@lru_cache(maxsize=8)
def house_of(houses: str, index: int, assets: Path | None) -> tuple[House, Navigation]:
    house = load_house(f"{houses}:{index}", assets=assets)
    return house, navigate(house.plan)
