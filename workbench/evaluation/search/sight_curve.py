"""The sight experiment: what seeing open furniture in passing saves in object search, by range of sight."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from workbench.beliefs.estimators import estimator
from workbench.errors import BadValue, LiosError
from workbench.evaluation.failed_estimator import ESTIMATOR_FAULTS
from workbench.evaluation.search.missed_looks import MissedLooks, draw_of, search_with_misses
from workbench.evaluation.search.seen_in_passing import Seeing, search_with_sight
from workbench.evaluation.search.trials import (
    ASKS_NO_BELIEF,
    PAPER_POLICY,
    Beliefs,
    SearchTrial,
    queries,
    search_trial,
)
from workbench.evaluation.statistics import mean_with_interval, ratio_with_interval
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.search.policies.oracle import oracle_policy
from workbench.search.policies.registry import policy
from workbench.search.policy import SearchPolicy
from workbench.worlds.house import House, ItemType
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.sight.lines_of_sight import checked_radius
from workbench.worlds.sight.sightings import SightPaths
from workbench.worlds.travel import TravelCosts


def radii_named(text: str) -> tuple[float, ...]:
    """The sight radii of a list such as "1,2.5,4", in metres, in order and each once.

    Raises:
        BadValue: one is no number, or no sight radius above 0.
    """
    radii: list[float] = []
    for word in text.split(","):
        try:
            radius_m = checked_radius(float(word))
        except ValueError:
            radius_m = 0.0
        if not radius_m:
            raise BadValue("--sees", text, "metres above 0, or several separated by commas: 1,2.5,4")
        radii.append(radius_m)
    return tuple(sorted(set(radii)))


@dataclass(frozen=True, slots=True, kw_only=True)
class SightSearches:
    """The settings of the experiment.

    Attributes:
        policies: names, without the oracle.
        radii_m: how far the robot sees, in metres.
        estimator: of all policies but the paper's, whose is paper_estimator.
        asked: item types by house; None for all. Houses without an entry are left out.
        miss_rate: the chance that a look misses an item, with sight and without; the oracle's never do.
        seed: of the draws of misses and of the bootstrap.
    """

    policies: tuple[str, ...]
    radii_m: tuple[float, ...]
    estimator: str = "best"
    paper_estimator: str = "fcnn"
    asked: Mapping[str, tuple[ItemType, ...]] | None = None
    costs: ActionCosts = SIMULATION_COSTS
    miss_rate: float = 0.0
    seed: int = 0

    def misses_of(self, house: str, item_type: ItemType) -> MissedLooks:
        """How looks miss in one query."""
        return MissedLooks(rate=self.miss_rate, seed=draw_of(self.seed, house, item_type))

    def beliefs_of(self, name: str, sought: tuple[ItemType, ...]) -> Beliefs | None:
        """The beliefs of a policy in one house; None for one that uses none."""
        if name in ASKS_NO_BELIEF:
            return None
        named = self.paper_estimator if name == PAPER_POLICY else self.estimator
        return Beliefs(estimator(named, origin=NameOrigin.USER), sought)


@dataclass(frozen=True, slots=True, kw_only=True)
class SightCost:
    """The costs of one query by one policy: without sight, with it, and of the oracle."""

    radius_m: float
    policy: str
    house: str
    without: float
    seeing: float
    oracle: float
    searches_without: int
    searches_seeing: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SightHouse:
    """The results in one house, or why there are none."""

    house: str
    costs: tuple[SightCost, ...]
    skipped: str = ""


def searches_with_sight(houses: Iterable[House], settings: SightSearches) -> Iterator[SightHouse]:
    """Every radius, policy and query, house by house."""
    for house in houses:
        if settings.asked is not None and house.plan.name not in settings.asked:
            continue
        try:
            costs = tuple(_in_house(house, settings))
        except ESTIMATOR_FAULTS:
            raise
        except LiosError as error:
            yield SightHouse(house=house.plan.name, costs=(), skipped=str(error))
        else:
            yield SightHouse(house=house.plan.name, costs=costs)


def _in_house(house: House, settings: SightSearches) -> Iterator[SightCost]:
    navigation = navigate(house.plan)
    travel = navigation.travel
    sought = queries(house, travel) if settings.asked is None else settings.asked[house.plan.name]
    paths = [SightPaths(house.plan, travel, navigation, radius_m) for radius_m in settings.radii_m]
    oracle = oracle_policy(house)
    for name in settings.policies:
        searcher, beliefs = policy(name, origin=NameOrigin.USER), settings.beliefs_of(name, sought)
        for item in sought:
            least = search_trial(house, travel, item, oracle, None, costs=settings.costs).cost
            misses = settings.misses_of(house.plan.name, item)
            without = _without_sight(house, travel, item, searcher, beliefs, settings.costs, misses)
            for sight in paths:
                seen = Seeing(paths=sight, misses=misses)
                seeing = search_with_sight(house, item, searcher, beliefs, costs=settings.costs, seeing=seen)
                yield SightCost(
                    radius_m=sight.radius_m,
                    policy=name,
                    house=house.plan.name,
                    without=without.cost,
                    seeing=seeing.cost,
                    oracle=least,
                    searches_without=len(without.order),
                    searches_seeing=len(seeing.order),
                )


def _without_sight(
    house: House,
    travel: TravelCosts,
    item: ItemType,
    searcher: SearchPolicy,
    beliefs: Beliefs | None,
    costs: ActionCosts,
    misses: MissedLooks,
) -> SearchTrial:
    if not misses.rate:
        return search_trial(house, travel, item, searcher, beliefs, costs=costs)
    believer = None if beliefs is None else beliefs.estimator
    return search_with_misses(house, travel, item, searcher, believer, costs=costs, misses=misses)


def sight_rows(costs: Sequence[SightCost], *, seed: int) -> list[dict[str, Any]]:
    """One row for each policy and radius; intervals draw houses.

    Args:
        seed: of the bootstrap; every row draws the same houses.
    """
    kinds = dict.fromkeys((c.policy, c.radius_m) for c in costs)
    found = {kind: [c for c in costs if (c.policy, c.radius_m) == kind] for kind in kinds}
    return [_row(name, radius_m, found[name, radius_m], seed) for name, radius_m in kinds]


def sight_pairs(costs: Sequence[SightCost], *, seed: int) -> list[dict[str, Any]]:
    """What the second of two policies saves of what the first costs, both with sight, on the same searches."""
    pairs: list[dict[str, Any]] = []
    for radius_m in sorted({c.radius_m for c in costs}):
        of = {
            name: [c for c in costs if (c.policy, c.radius_m) == (name, radius_m)]
            for name in {c.policy: 0 for c in costs}
        }
        for a, b in combinations(of, 2):
            first, second = (np.array([c.seeing for c in of[name]]) for name in (a, b))
            less = ratio_with_interval(
                first - second, first, [c.house for c in of[a]], rng=np.random.default_rng(seed)
            )
            pairs.append({"sees_m": radius_m, "a": a, "b": b, "b_saves_of_a": less.value, "ci95": less.interval})
    return pairs


def _row(name: str, radius_m: float, costs: Sequence[SightCost], seed: int) -> dict[str, Any]:
    without, seeing, oracle = (
        np.array([getattr(c, part) for c in costs]) for part in ("without", "seeing", "oracle")
    )
    houses = [c.house for c in costs]
    saved = ratio_with_interval(without - seeing, without, houses, rng=np.random.default_rng(seed))
    most = ratio_with_interval(without - oracle, without, houses, rng=np.random.default_rng(seed))
    cost = mean_with_interval(seeing, houses, rng=np.random.default_rng(seed))
    return {
        "policy": name,
        "sees_m": radius_m,
        "queries": len(costs),
        "houses": len(set(houses)),
        "cost_without": float(without.mean()),
        "cost_seeing": cost.value,
        "cost_seeing_ci95": cost.interval,
        "cost_oracle": float(oracle.mean()),
        "saved": saved.value,
        "saved_ci95": saved.interval,
        "oracle_saves": most.value,
        "oracle_saves_ci95": most.interval,
        "searches_without": float(np.mean([c.searches_without for c in costs])),
        "searches_seeing": float(np.mean([c.searches_seeing for c in costs])),
        "ci95_resamples": cost.resampled(),
    }
