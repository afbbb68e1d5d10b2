"""Bounds of the cost from a state on without running the strategy, cached for each state.

The lower bound is what must still be paid in the luckiest world, the upper bound what can still be paid in the
unluckiest. Both depend only on what is known of the goal's items and on which containers are left, so that strategies
over one log that reach the same state share them.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from functools import cached_property
from math import inf
from typing import final

from replayers.counterfactual.bounds.lower_bound import LowerBound
from replayers.counterfactual.bounds.nearest_first_bound import NearestFirstBound
from replayers.counterfactual.bounds.plain_bounds import PlainInterval, plain_bounds_of
from replayers.counterfactual.bounds.upper_bound import UpperBound
from replayers.counterfactual.estimates.intervals import CostInterval
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Relevance
from replayers.counterfactual.strategy_traits import UNKNOWN, SearchTraits
from workbench.caches import Cache
from workbench.planning.tasks import goal_types
from workbench.worlds.knowledge import Knowledge

MAX_CACHED_STATES = 20_000
"""Entries in the cache; beyond this, it is cleared."""


@final
class StateBounds:
    """The bounds for one log, one task and one kind of strategy; arguments as for UpperBound and LowerBound.

    Args:
        least: the lower bound, which all kinds of strategies share; None for one of its own.

    Attributes:
        least, most: the lower and the upper bound.
    """

    def __init__(
        self,
        evidence: Evidence,
        relevance: Relevance,
        traits: SearchTraits = UNKNOWN,
        least: LowerBound | None = None,
    ) -> None:
        self.least = LowerBound(evidence, relevance) if least is None else least
        if evidence.tags is not None:  # after a stop for a tag the next look is not the nearest to a container
            traits = replace(traits, nearest_first=False)
        self.most = UpperBound(evidence, traits)
        self._goes_in_chains = traits.nearest_first and traits.empty_handed and traits.plans_shortest
        self._evidence, self._relevance = evidence, relevance
        self._sees = evidence.passing is not None
        self._stops = evidence.tags is not None
        self._types = goal_types(evidence.task.goal)
        self._misses_left = evidence.misses_left
        self._searchable = (*evidence.contents, *evidence.open, *evidence.refused_searches)
        self._bounded: Cache[Hashable, tuple[float, float, bool]] = Cache(MAX_CACHED_STATES)
        self._plain = plain_bounds_of(evidence, relevance, traits)
        self._last: tuple[Knowledge, PlainInterval] | None = None

    def interval(self, knowledge: Knowledge, *, walking: bool = False) -> CostInterval:
        """Bounds of the cost from a state on.

        Args:
            walking: the robot is on a move, and does not know all of it yet (run_tree.UnfinishedWalk).
        """
        if self._plain is not None and (plain := self._plain.of(knowledge)) is not None:
            self._last = knowledge, plain
            return CostInterval(plain.low, plain.high, may_fail=not plain.certain)
        key = (*self._key(knowledge), walking)
        low, high, certain = self._bounded.get(key, lambda: self.of_classes(knowledge, walking=walking))
        return CostInterval(low, high, may_fail=not certain)

    def nothing_missing(self, knowledge: Knowledge) -> bool:
        """As UpperBound.nothing_missing; known already of the state whose interval was asked for last."""
        if self._last is not None and self._last[0] is knowledge:
            return self._last[1].all_known
        return self.most.nothing_missing(knowledge)

    def of_classes(self, knowledge: Knowledge, *, walking: bool = False) -> tuple[float, float, bool]:
        """Bounds of the cost from a state on, by the classes of the bounds: from below, from above (infinite if
        nothing bounds it), and whether every world can meet the goal."""
        low = self.least.remaining_cost(knowledge)
        if not self.most.fits_straight:
            return low, inf, False
        if self._sees:
            return low, self.most.seeing(knowledge, walking=walking), self.least.certainly_possible(knowledge)
        high = self.most.direct_route_bound(knowledge)
        if self._stops:
            high += self.most.detours(knowledge)
        if self._goes_in_chains:
            high = min(high, self._chains.remaining_cost(knowledge))
        return low, high, self.least.certainly_possible(knowledge)

    @cached_property
    def _chains(self) -> NearestFirstBound:
        return NearestFirstBound(self._evidence, self._relevance)

    def _key(self, knowledge: Knowledge) -> tuple[Hashable, ...]:
        """Everything in a state that the two bounds depend on."""
        left = tuple([c for c in self._searchable if c not in knowledge.first_seen])
        stand = tuple([knowledge.where(t) for t in self._types])
        return knowledge.robot_at, knowledge.holding, left, stand, knowledge.facts, self._misses_left(knowledge)
