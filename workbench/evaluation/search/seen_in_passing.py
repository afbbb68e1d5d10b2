"""One search by a robot that sees open furniture in passing, step by step as the closed loop makes it.

It stops where its target container or the item that it seeks comes into view, and decides again from there. A
container seen in passing need not be looked into, and seeing it costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from workbench.beliefs.after_looks import after_looks
from workbench.beliefs.belief import Belief
from workbench.evaluation.search.missed_looks import MAX_QUERY_LOOKS, NO_MISSES, MissedLooks, chance_to_find
from workbench.evaluation.search.trials import Beliefs, SearchTrial, empty_belief
from workbench.execution.further_looks import worth_another_look
from workbench.planning.tasks import find_task
from workbench.search.costs import ActionCosts
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, House, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.perception import missing_at
from workbench.worlds.sight.sightings import SightPaths, Walk


@dataclass(frozen=True, slots=True, kw_only=True)
class Seeing:
    """How the robot of a search sees.

    Attributes:
        paths: of the house, with what comes into view on them.
        misses: how looks miss, those in passing too; the view from the start pose misses nothing.
    """

    paths: SightPaths
    misses: MissedLooks = NO_MISSES


def search_with_sight(
    house: House,
    item_type: ItemType,
    searcher: SearchPolicy,
    beliefs: Beliefs | None,
    *,
    costs: ActionCosts,
    seeing: Seeing,
) -> SearchTrial:
    """Run one search trial; the house holds a reachable instance.

    Args:
        beliefs: None for a policy without beliefs.
    """
    paths, perception = seeing.paths, missing_at(seeing.misses.rate)
    task = replace(find_task(item_type, START), available=(item_type,))
    at_start = {s.container: house.contents[s.container] for s in paths.at_start()}
    knowledge = knowledge_at_start(house.plan, paths.travel_from(START), at_start)
    cost, order, said = 0.0, list[ContainerId](), list[float]()
    while not knowledge.where(item_type) and len(order) < MAX_QUERY_LOOKS:
        knowledge = knowledge.with_another_look_at(worth_another_look(knowledge, perception, task, searcher))
        if not knowledge.unsearched:
            break
        query = SearchQuery(
            item_type=item_type,
            origin=knowledge.robot_at,
            target=START,
            belief=after_looks(_believed(beliefs, item_type, knowledge, seeing.misses), knowledge, perception),
            travel=knowledge.travel,
            costs=costs,
        )
        container = first_stop(searcher, query)
        if container is None:
            break
        before = knowledge.first_seen
        metres, knowledge = _go(house, knowledge, LocationId(container), item_type, seeing)
        cost += metres
        if knowledge.first_seen is before:
            if beliefs is not None:
                said.append(chance_to_find(query.belief, item_type, container))
            shown = seeing.misses.shown(house, container, knowledge.looks(container))
            knowledge = knowledge.seen(container, shown)
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


def _believed(beliefs: Beliefs | None, item_type: ItemType, knowledge: Knowledge, misses: MissedLooks) -> Belief:
    """What is believed before the looks count; kept by searched containers where looks show everything."""
    if beliefs is None:
        return empty_belief(item_type, knowledge)
    return beliefs.estimator.believe(knowledge, (item_type,)) if misses.rate else beliefs.about(item_type, knowledge)


def _go(
    house: House, knowledge: Knowledge, to: LocationId, item_type: ItemType, seeing: Seeing
) -> tuple[float, Knowledge]:
    """Metres walked towards a place, and the knowledge after that."""
    walk = seeing.paths.walk(
        knowledge.robot_at,
        to,
        seeking=(item_type,),
        known=knowledge.first_seen,
        shows=lambda container: seeing.misses.shown(house, container, 0),
    )
    if not isinstance(walk, Walk):
        raise ValueError(f"no way from {knowledge.robot_at} to {to}")
    knowledge = replace(knowledge, travel=seeing.paths.travel_from(walk.end)).moved(walk.end)
    for sighting, items in walk.seen:
        knowledge = knowledge.seen(sighting.container, items)
    return walk.metres, knowledge
