"""What does it cost, on average, to find an object? Eq. 1 of the paper, for every type, origin and target at once.

The recursion and its weights are in reference.py; compiled.py runs the same program faster. Candidates are one
set per item type (candidates.py), so that the table obeys the triangle inequality: walking first and searching
then never costs less than the find from where one stands.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from workbench.beliefs.belief import Belief
from workbench.search import reference
from workbench.search.candidates import PAPER_LIMIT, Ranking, check_limit, choose, ranking_of
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.orders import ExpectedSearch, along
from workbench.search.places import Places, places
from workbench.search.policy import SearchQuery
from workbench.search.remaining import still_missing_by_subset
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts

Array = npt.NDArray[np.float64]


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
        ranking: which containers are candidates; None takes the paper's for `independent`, ours otherwise.

    Returns:
        Find costs of kind "model". With nothing left to search every entry is 0, as Eq. 1 says of an empty U:
        whoever offers finds asks first whether the belief has containers.

    Raises:
        LocationOutOfReach: an origin or target that is not among the travel costs.
        BadValue: a limit below 1, or an unknown belief model.
        TooManyCandidates: a limit above MAX_LIMIT.
    """
    check_limit(limit)
    here = places(belief, travel, origins=origins, targets=targets)
    metres = np.zeros((len(belief.item_types), len(origins), len(targets)))
    if here.containers and metres.size:
        for item in range(len(belief.item_types)):
            metres[item] = _one_item(here, item, costs, belief_model, limit, ranking or ranking_of(belief_model))
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
    """The minimiser of Eq. 1 for one query: the whole order over its candidates, with partial costs.

    Raises:
        ValueError: the item type is not in the belief.
        The others as expected_find_costs.
    """
    check_limit(limit)
    here = places(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
    item = query.belief.item_types.index(query.item_type)
    if not here.containers:
        return ExpectedSearch(stops=(), partial_costs=(), cost=0.0, missing=1.0)
    chosen = _candidates(here, item, limit, ranking or ranking_of(belief_model))
    missing = still_missing_by_subset(here.probability[item], chosen, belief_model)
    found = query.costs.manipulation + here.to_m[chosen]
    between = here.between_m[np.ix_(chosen, chosen)]
    table = reference.subset_costs(missing, between, found, query.costs.search)[:, :, 0]
    order = reference.best_order(missing, table, here.from_m[0, chosen], between, found[:, 0], query.costs.search)
    return along(chosen[order], here, item=item, model=belief_model, costs=query.costs)


def _candidates(here: Places, item: int, limit: int, ranking: Ranking) -> npt.NDArray[np.intp]:
    return choose(
        here.probability[item], here.from_m.mean(axis=0), here.to_m.mean(axis=1), limit=limit, ranking=ranking
    )


def _one_item(here: Places, item: int, costs: ActionCosts, model: BeliefModel, limit: int, ranking: Ranking) -> Array:
    chosen = _candidates(here, item, limit, ranking)
    missing = still_missing_by_subset(here.probability[item], chosen, model)
    found = costs.manipulation + here.to_m[chosen]
    table = reference.subset_costs(missing, here.between_m[np.ix_(chosen, chosen)], found, costs.search)
    return reference.from_origins(missing, table, here.from_m[:, chosen], found, costs.search)
