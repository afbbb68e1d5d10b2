"""One search by a robot that sees open furniture in passing (worlds/sight): the closed loop's, step by step.

A search ends at once for an item that is seen, wherever the robot is: it turns off and fetches it. What it sees
besides it need not look into, which costs nothing.
"""

from __future__ import annotations

import numpy as np

from workbench.beliefs.belief import Estimator
from workbench.evaluation.search.trials import SearchTrial, empty_belief
from workbench.search.costs import ActionCosts
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, House, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.sight.sightings import Sightings
from workbench.worlds.travel import TravelCosts


def search_with_sight(
    house: House,
    travel: TravelCosts,
    item_type: ItemType,
    searcher: SearchPolicy,
    estimator: Estimator | None,
    *,
    costs: ActionCosts,
    sightings: Sightings,
) -> SearchTrial:
    """Run one search trial; the house holds a reachable instance.

    Args:
        estimator: None for a policy without beliefs.
        sightings: of this house.
    """
    at_start = {s.container: house.contents[s.container] for s in sightings.at_start()}
    knowledge = knowledge_at_start(house.plan, travel, at_start)
    cost, order, said = 0.0, list[ContainerId](), list[float]()
    while not knowledge.where(item_type) and knowledge.unsearched:
        belief = (
            empty_belief(item_type, knowledge) if estimator is None else estimator.believe(knowledge, (item_type,))
        )
        query = SearchQuery(
            item_type=item_type,
            origin=knowledge.robot_at,
            target=START,
            belief=belief,
            travel=travel,
            costs=costs,
        )
        container = first_stop(searcher, query)
        if container is None:
            break
        metres, moved = _go(house, knowledge, LocationId(container), item_type, sightings)
        cost += metres
        if moved.first_seen.keys() == knowledge.first_seen.keys():
            if estimator is not None:
                said.append(float(belief.of(item_type)[belief.containers.index(container)]))
            moved = moved.seen(container, house.contents[container])
            cost += costs.search
            order.append(container)
        knowledge = moved
    places = [at for at, _ in knowledge.where(item_type)]
    if places:
        here, home = travel.index(knowledge.robot_at), travel.index(START)
        at = travel.rows(tuple(places))
        cost += costs.manipulation + float(np.min(travel.metres[here, at] + travel.metres[at, home]))
    return SearchTrial(
        house=house.plan.name,
        item_type=item_type,
        policy=searcher.name,
        cost=cost,
        order=tuple(order),
        said=tuple(said),
        found=bool(places),
    )


def _go(
    house: House, knowledge: Knowledge, to: LocationId, item_type: ItemType, sightings: Sightings
) -> tuple[float, Knowledge]:
    """Metres walked, and the knowledge after going to a place, or to the item once it comes into view."""
    here = knowledge.robot_at
    metres, end, seen = knowledge.travel.between(here, to) or 0.0, to, sightings.along(here, to)
    for sighting in seen:
        new = sighting.container not in knowledge.first_seen
        if new and any(item.type == item_type for item in house.contents[sighting.container]):
            turn = sightings.turn(here, to, sighting.container)
            if turn is not None:
                metres, end, seen = turn.metres, turn.at, turn.sightings
            break
    knowledge = knowledge.moved(end)
    for sighting in seen:
        if sighting.container not in knowledge.first_seen:
            knowledge = knowledge.seen(sighting.container, house.contents[sighting.container])
    return metres, knowledge
