"""The paper's two find costs without a belief model: optimistic and pessimistic.

optimistic(o, from, to) = min over unsearched a of d(from, a) + R_search + R_pick + d(a, to): as if the object were
certain to be in the container with the smallest detour. pessimistic = optimistic + 200.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.beliefs.belief import Belief
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import FindCosts
from workbench.search.places import search_space
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts

PESSIMISTIC_PENALTY = 200.0


def optimistic_find_costs(
    belief: Belief,
    travel: TravelCosts,
    *,
    origins: Sequence[LocationId],
    targets: Sequence[LocationId],
    costs: ActionCosts,
) -> FindCosts:
    """Lower bounds on find costs, equal for all item types; 0 if nothing is left to search.

    Raises:
        LocationOutOfReach: an origin or target that is not among the travel costs.
    """
    here = search_space(belief, travel, origins=origins, targets=targets)
    least = np.zeros((len(origins), len(targets)))
    if here.containers:
        lengths = here.from_m[:, :, None] + here.to_m[None, :, :]
        least = lengths.min(axis=1) + costs.search + costs.manipulation
    return FindCosts(
        item_types=belief.item_types,
        origins=tuple(origins),
        targets=tuple(targets),
        metres=np.repeat(least[None], len(belief.item_types), axis=0),
        kind="optimistic",
    )


def pessimistic_find_costs(
    belief: Belief,
    travel: TravelCosts,
    *,
    origins: Sequence[LocationId],
    targets: Sequence[LocationId],
    costs: ActionCosts,
) -> FindCosts:
    """The optimistic costs plus PESSIMISTIC_PENALTY, so that search is the last resort."""
    optimistic = optimistic_find_costs(belief, travel, origins=origins, targets=targets, costs=costs)
    return FindCosts(
        item_types=optimistic.item_types,
        origins=optimistic.origins,
        targets=optimistic.targets,
        metres=optimistic.metres + PESSIMISTIC_PENALTY,
        kind="pessimistic",
    )
