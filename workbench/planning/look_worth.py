"""What is a look into a container worth to a search that comes later?

A search that is still to come costs F on average: Eq. 1 over its whole order, given that an instance exists. After a
look at container a it costs less on average. With chance p(a) the object is there, and is then fetched from a for
K(a); else the search follows the same order without a, for F(a), each chance grown by what a no longer holds:

    worth(a) = F - p(a) K(a) - (1 - p(a)) F(a)

All F(a) come from sums over the stops before and after a, so that a whole house is one pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from workbench.planning.composed import only
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import View
from workbench.search.places import Places, places
from workbench.search.policy import SearchPolicy, SearchQuery
from workbench.search.remaining import unconditioned
from workbench.worlds.house import ContainerId

Array = npt.NDArray[np.float64]

MOST_CHANCE = 1 - 1e-9
"""A chance of 1 is taken for this, so that a search may still go on without the container."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """A find of a plan, with the order in which a policy would look.

    Attributes:
        here: from the find's origin, to its target.
        order: indices into here.containers.
        chance: before it is known that an instance exists (remaining.unconditioned), shape (containers,).
    """

    query: SearchQuery
    here: Places
    order: npt.NDArray[np.int64]
    chance: Array


def search_of(find: PlanStep, view: View, policy: SearchPolicy) -> Search:
    """How a policy would carry out a find of a plan."""
    query = SearchQuery(
        item_type=find.item_types[0],
        origin=find.origin,
        target=find.target,
        belief=only(view.belief, find.item_types),
        travel=view.knowledge.travel,
        costs=view.costs,
    )
    here = places(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
    at = {container: index for index, container in enumerate(here.containers)}
    order = np.array([at[stop.container] for stop in policy.order(query)], dtype=np.int64)
    chance = unconditioned(here.probability, "marginal")[0]
    return Search(query=query, here=here, order=order, chance=chance)


def worth_of_looks(finds: Sequence[PlanStep], view: View, policy: SearchPolicy) -> dict[ContainerId, float]:
    """What a look into each container is worth to all these finds together, in cost units; 0 at least."""
    worth = dict.fromkeys(view.belief.containers, 0.0)
    for find in finds:
        search = search_of(find, view, policy)
        for index, value in zip(search.order, _worth(search), strict=True):
            worth[search.here.containers[index]] += float(value)
    return worth


def _worth(search: Search) -> Array:
    """Along the order, shape (stops,)."""
    here, order, costs = search.here, search.order, search.query.costs
    if len(order) == 0:
        return np.zeros(0)
    q = np.minimum(search.chance[order], MOST_CHANCE)
    legs = np.concatenate([here.from_m[0, order[:1]], here.between_m[order[:-1], order[1:]]]) + costs.search
    ends = costs.manipulation + here.to_m[order, 0]
    missing = np.cumprod(np.concatenate([[1.0], 1.0 - q]))
    nowhere = missing[-1]
    walked = _sums(missing[:-1] * legs)
    length = _sums(legs)
    found = _sums(missing[:-1] * q * ends)
    exists = max(1.0 - nowhere, 1e-12)
    total = (walked[-1] - nowhere * length[-1] + found[-1]) / exists
    kept = 1.0 - q
    before = walked[:-1] - nowhere / kept * length[:-1] + found[:-1]
    after = found[-1] - found[1:] + walked[-1] - nowhere * length[-1]
    after[:-1] += nowhere * length[2:] - walked[2:]
    after[-1] = 0.0
    skip = here.between_m[order[:-2], order[2:]] if len(order) > 2 else np.zeros(0)
    around = np.concatenate([here.from_m[0, order[1:2]], skip]) + costs.search
    after[:-1] += (missing[1:-1] - nowhere) * around
    without = (before + after / kept) / np.maximum(1.0 - nowhere / kept, 1e-12)
    p = np.minimum(q / exists, 1.0)
    fetched = here.from_m[0, order] + ends
    return np.maximum(total - p * fetched - (1.0 - p) * without, 0.0)


def _sums(values: Array) -> Array:
    """Sums of the first 0, 1, 2, ... values."""
    return np.concatenate([[0.0], np.cumsum(values)])
