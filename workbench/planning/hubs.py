"""A few meeting places for items that are to be prepared together, chosen near what is needed."""

from __future__ import annotations

import numpy as np

from workbench.planning.actions import prepares, relevant_types
from workbench.planning.strategy import View
from workbench.search.ties import ranked
from workbench.tolerances import RELATIVE
from workbench.worlds.house import LocationId

HUBS = 4


def hubs_for(view: View) -> tuple[LocationId, ...]:
    """The reachable locations from which the relevant types are nearest on average, best first; of equal ones
    (ties.py) the earlier.

    The distance to a type is that to its nearest known instance, or the mean over the belief's containers weighted
    by probability. Goals without preparations have no hubs.
    """
    if not prepares(view.task.goal):
        return ()
    travel, knowledge, belief = view.knowledge.travel, view.knowledge, view.belief
    columns = [travel.index(LocationId(c)) for c in belief.containers]
    score = np.zeros(len(travel.locations))
    for item_type in relevant_types(view.task.goal):
        known = [travel.index(place) for place, _ in knowledge.where(item_type) if travel.reaches(place)]
        if known:
            score += travel.metres[:, known].min(axis=1)
        elif item_type in belief.item_types and columns:
            p = belief.of(item_type)
            weight = p / p.sum() if p.sum() > RELATIVE else np.full(len(p), 1 / len(p))
            score += travel.metres[:, columns] @ weight
    best = ranked(-score[None], HUBS)[0]
    return tuple(travel.locations[int(i)] for i in best)
