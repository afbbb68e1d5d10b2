"""Find costs by Eq. 1 with separate candidates for every origin and target.

The table of engine.expected_find_costs has one candidate set per item type, chosen by mean distances. A find that is
carried out chooses by its own origin and target. Where there are more containers than candidates the two differ, and
so do their costs. Here every entry is over the candidates of its own find, so it is the expected cost of the order
that the policy intends. The price: finds that share candidates share one program, and there are many more of those;
and walking first and searching then may be cheaper than the find from where one stands, since it is another find.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.beliefs.belief import Belief
from workbench.search.candidates import PAPER_LIMIT, Ranking, check_limit, choose_per_find, ranking_of
from workbench.search.costs import ActionCosts
from workbench.search.engine import MAX_SUBSETS, cost_table, program
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.places import SearchSpace, search_space
from workbench.search.remaining import still_missing_by_subset
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts


def per_find_costs(
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
    """Eq. 1 for all (item type, origin, target), each over the candidates that a search between the two has.

    Args, Returns, Raises:
        As engine.expected_find_costs; each entry is engine.expected_search's cost for the same query.
    """
    here = search_space(belief, travel, origins=origins, targets=targets)
    return FindCosts(
        item_types=belief.item_types,
        origins=tuple(origins),
        targets=tuple(targets),
        metres=per_find_table(here, costs=costs, belief_model=belief_model, limit=limit, ranking=ranking),
        kind="model",
        belief_model=belief_model,
    )


def per_find_table(
    here: SearchSpace, *, costs: ActionCosts, belief_model: BeliefModel, limit: int, ranking: Ranking | None = None
) -> Floats:
    """The costs for all of `here`, shape (item types, origins, targets)."""
    check_limit(limit)
    metres = np.zeros((len(here.probability), len(here.from_m), here.to_m.shape[1]))
    if len(here.containers) <= limit or not metres.size:  # all are candidates of every find
        return cost_table(here, costs=costs, belief_model=belief_model, limit=limit, ranking=ranking)
    chosen = choose_per_find(
        here.probability, here.from_m, here.to_m, limit=limit, ranking=ranking or ranking_of(belief_model)
    )
    found = costs.manipulation + here.to_m
    for item, of_pairs in enumerate(chosen):
        sets, start, pairs = _grouped(of_pairs)
        at_once = max(1, MAX_SUBSETS >> limit)
        for first in range(0, len(sets), at_once):
            some = sets[first : first + at_once]
            offsets = start[first : first + len(some) + 1]
            these = pairs[offsets[0] : offsets[-1]]
            p = np.broadcast_to(here.probability[item], (len(some), len(here.containers)))
            missing = still_missing_by_subset(p, some, belief_model)
            made = program().pair_costs(
                missing, some, here.between_m, here.from_m, found, costs.search, offsets - offsets[0], these
            )
            metres[item, these[:, 0], these[:, 1]] = np.maximum(made, 0.0)
    return metres


def _grouped(of_pairs: Indices) -> tuple[Indices, Indices, Indices]:
    """The different candidate sets, and the pairs of each.

    Args:
        of_pairs: shape (origins, targets, k).

    Returns:
        The sets, shape (sets, k); where the pairs of each begin, and the end, shape (sets + 1,); the pairs by set, an
        origin and a target each, shape (pairs, 2).
    """
    _, targets, k = of_pairs.shape
    sets, of_pair, counts = np.unique(of_pairs.reshape(-1, k), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(of_pair.reshape(-1), kind="stable")
    pairs = np.stack(np.divmod(order, targets), axis=1)
    return sets, np.concatenate([[0], np.cumsum(counts)]), pairs
