"""Expected find costs by Eq. 1 of the paper, for all item types, origins and targets of a house at once.

The recursion and its weights are in reference.py; compiled.py is a faster implementation. Each item type has one
candidate set (candidates.py), so that the table obeys the triangle inequality: walking first and then searching
never costs less than searching from the current location.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol, cast

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.beliefs.belief import Belief
from workbench.search import reference
from workbench.search.candidates import PAPER_LIMIT, Ranking, check_limit, choose, ranking_of
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.orders import ExpectedSearch, order_cost
from workbench.search.places import SearchSpace, search_space
from workbench.search.policy import SearchQuery
from workbench.search.remaining import still_missing_by_subset
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts

MAX_SUBSETS = 1 << 22
"""Most subsets held in memory at once, over all item types."""


def expected_find_costs(
    belief: Belief,
    travel: TravelCosts,
    *,
    origins: Sequence[LocationId],
    targets: Sequence[LocationId],
    costs: ActionCosts,
    belief_model: BeliefModel = "independent",
    limit: int = PAPER_LIMIT,
    ranking: Ranking | None = None,
) -> FindCosts:
    """Eq. 1 for all (item type, origin, target), exact over at most `limit` candidates per item type.

    Args:
        ranking: how candidates are chosen; None takes the paper's ranking for `independent`, ours otherwise.

    Returns:
        Find costs of kind "model". If nothing is left to search, every entry is 0, as by Eq. 1 for an empty U:
            callers must check first that the belief has containers.

    Raises:
        LocationOutOfReach: an origin or target that is not among the travel costs.
        BadValue: a limit below 1, or an unknown belief model.
        TooManyCandidates: a limit above MAX_LIMIT.
    """
    here = search_space(belief, travel, origins=origins, targets=targets)
    metres = cost_table(here, costs=costs, belief_model=belief_model, limit=limit, ranking=ranking)
    return FindCosts(
        item_types=belief.item_types,
        origins=tuple(origins),
        targets=tuple(targets),
        metres=metres,
        kind="model",
        belief_model=belief_model,
    )


def expected_search(
    query: SearchQuery,
    *,
    belief_model: BeliefModel = "independent",
    limit: int = PAPER_LIMIT,
    ranking: Ranking | None = None,
) -> ExpectedSearch:
    """The optimal order of candidates by Eq. 1 for one query, with partial costs.

    Raises:
        ValueError: the item type is not in the belief, or what expected_find_costs raises.
    """
    check_limit(limit)
    here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
    item = query.belief.item_types.index(query.item_type)
    if not here.containers:
        return ExpectedSearch(stops=(), partial_costs=(), cost=0.0, missing=1.0)
    order = best_order(here, item, costs=query.costs, belief_model=belief_model, limit=limit, ranking=ranking)
    return order_cost(order, here, item=item, model=belief_model, costs=query.costs)


def cost_table(
    here: SearchSpace,
    *,
    costs: ActionCosts,
    belief_model: BeliefModel,
    limit: int,
    ranking: Ranking | None = None,
    tail: Callable[[Floats, Indices], Floats] | None = None,
) -> Floats:
    """Eq. 1 for all of `here`, shape (item types, origins, targets).

    Args:
        tail: a function of probabilities and candidates, shapes (item types, containers) and (item types, k),
            that returns the cost of searching on beyond them: `tail` of reference.cost_table.
    """
    check_limit(limit)
    metres = np.zeros((len(here.probability), len(here.from_m), here.to_m.shape[1]))
    if not here.containers or not metres.size:
        return metres
    at_once = max(1, MAX_SUBSETS >> min(limit, len(here.containers)))
    for first in range(0, len(metres), at_once):
        items = np.arange(first, min(first + at_once, len(metres)))
        setup = _setup(here, items, costs, belief_model, limit, ranking)
        ends = None if tail is None else tail(setup.probability, setup.candidates)
        table = program().cost_table(setup.missing, setup.between_m, setup.from_m, setup.found, costs.search, ends)
        metres[items] = np.maximum(table, 0.0)
    return metres


def best_order(
    here: SearchSpace,
    item: int,
    *,
    costs: ActionCosts,
    belief_model: BeliefModel,
    limit: int,
    ranking: Ranking | None = None,
) -> Indices:
    """The optimal order for one item type, from the first origin to the first target of `here`.

    Returns:
        Indices into here.containers, at most `limit` of them.
    """
    setup = _setup(here, np.array([item]), costs, belief_model, limit, ranking)
    order = program().best_order(
        setup.missing[0], setup.between_m[0], setup.from_m[0, 0], setup.found[0, :, 0], costs.search
    )
    return setup.candidates[0, order]


def first_stops(
    here: SearchSpace,
    *,
    costs: ActionCosts,
    belief_model: BeliefModel,
    limit: int,
    ranking: Ranking | None = None,
) -> list[int]:
    """The first container of the optimal order of every row of `here.probability`, as an index into
    here.containers."""
    rows = np.arange(len(here.probability))
    setup = _setup(here, rows, costs, belief_model, limit, ranking)
    search, find = program(), setup.found[:, :, 0]
    return [
        int(setup.candidates[k, search.best_order(setup.missing[k], between, from_m, found, costs.search)[0]])
        for k, between, from_m, found in zip(rows, setup.between_m, setup.from_m[:, 0], find, strict=True)
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setup:
    """The arrays of reference.cost_table, with their probabilities and candidates."""

    probability: Floats
    candidates: Indices
    missing: Floats
    between_m: Floats
    from_m: Floats
    found: Floats


def _setup(
    here: SearchSpace,
    items: Indices,
    costs: ActionCosts,
    model: BeliefModel,
    limit: int,
    ranking: Ranking | None,
) -> _Setup:
    probability = here.probability[items]
    chosen = choose(
        probability,
        here.from_m[0] if len(here.from_m) == 1 else here.from_m.mean(axis=0),
        here.to_m[:, 0] if here.to_m.shape[1] == 1 else here.to_m.mean(axis=1),
        limit=limit,
        ranking=ranking or ranking_of(model),
    )
    between_m, from_m, to_m = here.over(chosen)
    return _Setup(
        probability=probability,
        candidates=chosen,
        missing=still_missing_by_subset(probability, chosen, model),
        between_m=between_m,
        from_m=from_m,
        found=costs.manipulation + to_m,
    )


class SearchProgram(Protocol):
    """What reference.py and compiled.py both are."""

    def cost_table(
        self,
        missing: Floats,
        between_m: Floats,
        from_m: Floats,
        found: Floats,
        search: float,
        tail: Floats | None = None,
    ) -> Floats: ...

    def pair_costs(
        self,
        missing: Floats,
        sets: Indices,
        between_m: Floats,
        from_m: Floats,
        found: Floats,
        search: float,
        start: Indices,
        pairs: Indices,
    ) -> Floats: ...

    def best_order(
        self, missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float
    ) -> list[int]: ...


@cache
def program() -> SearchProgram:
    """The compiled program, or the readable one where numba cannot be imported."""
    try:
        from workbench.search import compiled
    except ImportError:
        return cast(SearchProgram, reference)
    return cast(SearchProgram, compiled)
