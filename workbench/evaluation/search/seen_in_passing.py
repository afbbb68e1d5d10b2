"""One search by a robot that sees open furniture in passing, step by step as the closed loop makes it.

It stops where its target container or the item that it seeks comes into view, and decides again from there. A
container seen in passing need not be looked into, and seeing it costs nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.evaluation.search.trials import Beliefs, SearchTrial, empty_belief
from workbench.search.costs import ActionCosts
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, House, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.sight.sightings import PassingWays, Walk
from workbench.worlds.travel import TravelCosts


def search_with_sight(
    house: House,
    travel: TravelCosts,
    item_type: ItemType,
    searcher: SearchPolicy,
    beliefs: Beliefs | None,
    *,
    costs: ActionCosts,
    ways: PassingWays,
) -> SearchTrial:
    """Run one search trial; the house holds a reachable instance.

    Args:
        beliefs: None for a policy without beliefs.
        ways: of this house.
    """
    at_start = {s.container: house.contents[s.container] for s in ways.at_start()}
    knowledge = knowledge_at_start(house.plan, ways.travel_from(START), at_start)
    cost, order, said = 0.0, list[ContainerId](), list[float]()
    while not knowledge.where(item_type) and knowledge.unsearched:
        belief = empty_belief(item_type, knowledge) if beliefs is None else beliefs.about(item_type, knowledge)
        query = SearchQuery(
            item_type=item_type,
            origin=knowledge.robot_at,
            target=START,
            belief=belief,
            travel=knowledge.travel,
            costs=costs,
        )
        container = first_stop(searcher, query)
        if container is None:
            break
        before = knowledge.first_seen
        metres, knowledge = _go(house, knowledge, LocationId(container), item_type, ways)
        cost += metres
        if knowledge.first_seen is before:
            if beliefs is not None:
                said.append(float(belief.of(item_type)[belief.containers.index(container)]))
            knowledge = knowledge.seen(container, house.contents[container])
            cost += costs.search
            order.append(container)
    places = tuple(at for at, _ in knowledge.where(item_type))
    if places:
        to, back = knowledge.travel.metres, knowledge.travel.rows(places)
        here, home = knowledge.travel.index(knowledge.robot_at), knowledge.travel.index(START)
        cost += costs.manipulation + float(np.min(to[here, back] + to[back, home]))
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
    house: House, knowledge: Knowledge, to: LocationId, item_type: ItemType, ways: PassingWays
) -> tuple[float, Knowledge]:
    """Metres walked towards a place, and the knowledge after that."""
    walk = ways.walk(
        knowledge.robot_at,
        to,
        seeking=(item_type,),
        known=knowledge.first_seen,
        shows=lambda container: house.contents[container],
    )
    if not isinstance(walk, Walk):
        raise ValueError(f"no way from {knowledge.robot_at} to {to}")
    knowledge = replace(knowledge, travel=ways.travel_from(walk.end)).moved(walk.end)
    for sighting, items in walk.seen:
        knowledge = knowledge.seen(sighting.container, items)
    return walk.metres, knowledge
