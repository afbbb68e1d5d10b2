"""Bounds of a state where nothing is out of the ordinary: deliveries of different types, as they are, over a log
whose looks show all and where nothing is refused.

They equal those of the bounds' own classes, in a fraction of the time (plain_kernel.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import permutations
from typing import NamedTuple, final

import numpy as np

from replayers.counterfactual.bounds.lower_bound import shortest_ways
from replayers.counterfactual.bounds.nearest_first_bound import NearestFirstBound
from replayers.counterfactual.bounds.plain_kernel import NOTHING, SOMETHING_ELSE, PlainLog, plain_bounds
from replayers.counterfactual.bounds.upper_bound import MAX_ORDERED
from replayers.counterfactual.evidence import Evidence, is_plain
from replayers.counterfactual.relevance import Relevance
from replayers.counterfactual.strategy_traits import SearchTraits
from workbench.arrays import Ints
from workbench.caches import Cache
from workbench.planning.tasks import AllOf, Delivered, distinct_deliveries
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.knowledge import Knowledge

MAX_PLACES = 100
"""With more containers, or parts and containers, sums would be added up in another order than numpy's."""

MAX_SETS_OF_CONTAINERS = 20_000
"""Sets of containers left as arrays; beyond this, the cache is cleared."""


class PlainInterval(NamedTuple):
    """Bounds from a state on: from below and above, whether every world can meet the goal, and whether nothing is
    missing."""

    low: float
    high: float
    certain: bool
    all_known: bool


def plain_bounds_of(evidence: Evidence, relevance: Relevance, traits: SearchTraits) -> PlainBounds | None:
    """The bounds over a log for a kind of strategy; None where something is out of the ordinary."""
    wants, index = distinct_deliveries(evidence.task.goal), _index_of(evidence)
    if not is_plain(evidence) or evidence.partly:
        return None
    if not 0 < len(wants) <= MAX_ORDERED or not all(want.at in index for want in wants):
        return None
    listed = [c for c in (*evidence.contents, *evidence.open) if LocationId(c) in index]
    in_plan = {c.id for c in evidence.place.plan.containers if LocationId(c.id) in index}
    if len(listed) > MAX_PLACES or set(listed) != in_plan:
        return None
    return PlainBounds(evidence, relevance, traits, wants)


@final
class PlainBounds:
    """The bounds for one log, one task and one kind of strategy; made by plain_bounds_of."""

    def __init__(
        self, evidence: Evidence, relevance: Relevance, traits: SearchTraits, wants: tuple[Delivered, ...]
    ) -> None:
        chains = NearestFirstBound(evidence, relevance)
        self._travel = evidence.travel
        self._index = _index_of(evidence)
        self._types = tuple(want.item_type for want in wants)
        self._column = chains.column
        self._left: Cache[tuple[ContainerId, ...], Ints] = Cache(MAX_SETS_OF_CONTAINERS)
        must = frozenset[str]() if relevance.hidden else relevance.must_exist
        self._log = PlainLog(
            metres=chains.metres,
            shortest=shortest_ways(evidence),
            at=chains.at,
            unseen=chains.unseen,
            logged=chains.shown,
            may=chains.may,
            targets=np.array([self._index[want.at] for want in wants], dtype=np.int64),
            anywhere=np.array([t in relevance.types for t in self._types], dtype=np.bool_),
            somewhere=np.array([t in must for t in self._types], dtype=np.bool_),
            exists=np.array([t in chains.exist for t in self._types], dtype=np.bool_),
            orders=np.array(list(permutations(range(len(wants)))), dtype=np.int64),
            look=float(evidence.costs.search),
            handle=float(evidence.costs.manipulation),
            is_one=not isinstance(evidence.task.goal, AllOf),
            nearest_first=traits.nearest_first,
            empty_handed=traits.empty_handed,
            plans_shortest=traits.plans_shortest,
        )

    def of(self, knowledge: Knowledge) -> PlainInterval | None:
        """The bounds from a state on; None where the robot is on its way, or containers were refused."""
        here, index, held = self._index.get(knowledge.robot_at), self._index, knowledge.holding
        if here is None or knowledge.closed or knowledge.again or knowledge.travel is not self._travel:
            return None
        hand = NOTHING
        if held is not None:
            hand = self._types.index(held.type) if held.type in self._types else SOMETHING_ELSE
        known, stand = [here, hand], list[int]()
        for item_type in self._types:
            before = len(stand)
            stand += [index[at] for at, _ in knowledge.where(item_type) if at in index]
            known.append(len(stand) - before)
        left = self._left.get(knowledge.unsearched, lambda: self._columns(knowledge.unsearched))
        low, high, *facts = plain_bounds(self._log, np.array([*known, *stand], dtype=np.int64), left)
        return PlainInterval(float(low), float(high), *map(bool, facts))  # also where nothing is compiled

    def _columns(self, containers: tuple[ContainerId, ...]) -> Ints:
        columns = [self._column[c] for c in containers]
        return np.array([columns, sorted(columns)], dtype=np.int64).reshape(2, len(columns))


def _index_of(evidence: Evidence) -> Mapping[LocationId, int]:
    return {name: i for i, name in enumerate(evidence.place.travel.locations)}
