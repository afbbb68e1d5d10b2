"""The memory experiment on object search: earlier searches in a house, then queries with and without memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.beliefs.estimators import estimator
from workbench.beliefs.memory.memory import Memory, PastLook, remember
from workbench.beliefs.memory.memory_estimator import MemoryEstimator
from workbench.beliefs.memory.move_rates import NS_PER_DAY, MoveRates
from workbench.errors import LiosError
from workbench.evaluation.failed_estimator import ESTIMATOR_FAULTS
from workbench.evaluation.memory.conditions import CONDITIONS, EARLIER_RUNS, HOUR_NS, MemoryCondition, MemoryCost
from workbench.evaluation.moved_house import moved_house
from workbench.evaluation.search.trials import ORACLE, Beliefs, queries, search_trial
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.search.policies.oracle import oracle_policy
from workbench.search.policies.registry import policy
from workbench.search.policy import SearchPolicy
from workbench.worlds.house import START, ContainerId, House, ItemType, LocationId
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.travel import TravelCosts

EARLIER_POLICY = "conditioned-lios"
"""The policy of the earlier runs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemorySearches:
    """The settings of the experiment.

    Attributes:
        policies: names; greedy and the oracle, which believe nothing, remember nothing.
        estimator: of all policies, with and without memory.
        asked: item types by house; None for all. Houses without an entry are left out.
    """

    policies: tuple[str, ...]
    rates: MoveRates
    estimator: str = "best"
    asked: Mapping[str, tuple[ItemType, ...]] | None = None
    costs: ActionCosts = SIMULATION_COSTS
    seed: int = 0
    conditions: tuple[MemoryCondition, ...] = CONDITIONS


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryHouse:
    """The results in one house, or why there are none."""

    house: str
    costs: tuple[MemoryCost, ...]
    skipped: str = ""


def remembered_searches(houses: Iterable[House], settings: MemorySearches) -> Iterator[MemoryHouse]:
    """Every condition, policy and query, house by house; a house's draws depend on the seed and its place alone."""
    for index, house in enumerate(houses):
        if settings.asked is not None and house.plan.name not in settings.asked:
            continue
        try:
            costs = tuple(_in_house(house, settings, index))
        except ESTIMATOR_FAULTS:
            raise
        except LiosError as error:
            yield MemoryHouse(house=house.plan.name, costs=(), skipped=str(error))
        else:
            yield MemoryHouse(house=house.plan.name, costs=costs)


def _in_house(house: House, settings: MemorySearches, index: int) -> Iterator[MemoryCost]:
    travel = navigate(house.plan).travel
    asked = queries(house, travel)
    wanted = asked if settings.asked is None else settings.asked[house.plan.name]
    drawn = np.random.default_rng((settings.seed, index, 0)).permutation(len(asked))[:EARLIER_RUNS]
    history = earlier_searches(house, travel, [asked[int(k)] for k in drawn], settings)
    for condition in settings.conditions:
        rng = np.random.default_rng((settings.seed, index, 1))  # the same things move first in every condition
        now = moved_house(house, travel, condition.moved, rng=rng)
        memory = remember(history, at_ns=round(condition.days * NS_PER_DAY), rates=settings.rates)
        sought = tuple(item for item in queries(now, travel) if item in wanted)
        for name in settings.policies:
            yield from _costs(now, travel, sought, name, condition, memory, settings)


def earlier_searches(
    house: House, travel: TravelCosts, sought: Sequence[ItemType], settings: MemorySearches
) -> tuple[PastLook, ...]:
    """What searches for some items saw, an hour after one another from time 0 on."""
    searcher = policy(EARLIER_POLICY, origin=NameOrigin.USER)
    beliefs = Beliefs(estimator(settings.estimator, origin=NameOrigin.USER), tuple(sought))
    looks: list[PastLook] = []
    for number, item in enumerate(sought):
        trial = search_trial(house, travel, item, searcher, beliefs, costs=settings.costs)
        looks += [_look(house, container, number) for container in trial.order]
    return tuple(looks)


def _look(house: House, container: ContainerId, number: int) -> PastLook:
    types = tuple(sorted({item.type for item in house.contents[container]}))
    return PastLook(container=container, seen_ns=number * HOUR_NS, item_types=types, run=f"earlier {number + 1}")


def _costs(
    house: House,
    travel: TravelCosts,
    sought: tuple[ItemType, ...],
    name: str,
    condition: MemoryCondition,
    memory: Memory,
    settings: MemorySearches,
) -> Iterator[MemoryCost]:
    base = estimator(settings.estimator, origin=NameOrigin.USER)
    plain, with_memory = Beliefs(base, sought), Beliefs(MemoryEstimator(base=base, memory=memory), sought)
    oracle = oracle_policy(house)
    chosen: SearchPolicy = oracle if name == ORACLE else policy(name, origin=NameOrigin.USER)
    seen = {item_type for look in memory.looks for item_type in look.item_types}
    for item in sought:
        without, remembered, least = (
            search_trial(house, travel, item, searcher, beliefs, costs=settings.costs).cost
            for searcher, beliefs in ((chosen, plain), (chosen, with_memory), (oracle, None))
        )
        yield MemoryCost(
            condition=condition.name,
            strategy=name,
            house=house.plan.name,
            known=item in seen,
            without=without,
            remembered=remembered,
            oracle=least,
            up_to_date=_up_to_date(house, travel, item, chosen, plain, memory, settings.costs),
        )


def _up_to_date(
    house: House,
    travel: TravelCosts,
    item: ItemType,
    searcher: SearchPolicy,
    beliefs: Beliefs,
    memory: Memory,
    costs: ActionCosts,
) -> float:
    """The cost where the robot knows what the remembered containers hold now: it fetches the nearest item there, or
    searches the rest."""
    current = {c: house.contents[c] for c in memory.by_container}
    trips = [
        (travel.between(START, LocationId(c)), travel.between(LocationId(c), START))
        for c, items in current.items()
        if any(thing.type == item for thing in items)
    ]
    fetched = [there + costs.manipulation + back for there, back in trips if there is not None and back is not None]
    if fetched:
        return min(fetched)
    return search_trial(house, travel, item, searcher, beliefs, costs=costs, known=current).cost
