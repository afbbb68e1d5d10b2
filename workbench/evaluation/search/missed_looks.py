"""One search where looks can miss: every policy goes on until it has found what exists.

A policy whose containers are all searched goes on by the posterior, as the closed loop does (further_looks.py), or,
as POLICY@start-over, as if it had seen nothing. The oracle knows what stands where, and no look of it misses.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import dataclass, replace

from workbench.beliefs.after_looks import after_looks
from workbench.beliefs.belief import Belief, Estimator
from workbench.evaluation.search.trials import SearchTrial, empty_belief
from workbench.execution.further_looks import worth_another_look
from workbench.planning.tasks import find_task
from workbench.search.costs import ActionCosts
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, House, Item, ItemType, LocationId
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.perception import missing_at
from workbench.worlds.simulated import is_missed
from workbench.worlds.travel import TravelCosts

START_OVER = "@start-over"
"""What follows the name of a policy that begins again without what it has seen, once everything is searched."""

MAX_QUERY_LOOKS = 10_000
"""A search that has made so many looks is given up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissedLooks:
    """How looks miss.

    Attributes:
        rate: the chance that a look misses an item; 0 for never.
        seed: of the draws, which are the same for every policy: by item, container and number of the look.
        start_over: whether a policy that has searched everything begins again without what it has seen.
    """

    rate: float = 0.0
    seed: int = 0
    start_over: bool = False

    def shown(self, house: House, container: ContainerId, look: int) -> tuple[Item, ...]:
        """What a look into a container shows, the first being number 0."""
        there = house.contents[container]
        return tuple(i for i in there if not is_missed(i.id, container, look=look, rate=self.rate, seed=self.seed))


NO_MISSES = MissedLooks()
"""Looks that show everything."""


def draw_of(seed: int, house: str, item_type: ItemType) -> int:
    """The seed of the misses in one query: the same for every policy."""
    return int.from_bytes(hashlib.sha256(f"{seed}/{house}/{item_type}".encode()).digest()[:4], "big") >> 1


def search_with_misses(
    house: House,
    travel: TravelCosts,
    item_type: ItemType,
    searcher: SearchPolicy,
    estimator: Estimator | None,
    *,
    costs: ActionCosts,
    misses: MissedLooks,
) -> SearchTrial:
    """Run one search trial; the house holds a reachable instance.

    Args:
        estimator: None for a policy without beliefs.
    """
    perception = missing_at(misses.rate)
    task = replace(find_task(item_type, START), available=(item_type,))
    knowledge = knowledge_at_start(house.plan, travel, {})
    looks, order, cost = Counter[ContainerId](), list[ContainerId](), 0.0
    said: list[float] = []
    found = False
    while not found and len(order) < MAX_QUERY_LOOKS:
        if misses.start_over and not knowledge.unsearched:
            knowledge = knowledge_at_start(house.plan, travel, {}).moved(knowledge.robot_at)
        knowledge = knowledge.with_another_look_at(worth_another_look(knowledge, perception, task, searcher))
        belief = (
            empty_belief(item_type, knowledge) if estimator is None else estimator.believe(knowledge, (item_type,))
        )
        query = SearchQuery(
            item_type=item_type,
            origin=knowledge.robot_at,
            target=START,
            belief=after_looks(belief, knowledge, perception),
            travel=travel,
            costs=costs,
        )
        container = first_stop(searcher, query)
        if container is None:
            break
        if estimator is not None:
            said.append(chance_to_find(query.belief, item_type, container))
        there = LocationId(container)
        cost += _metres(travel, knowledge.robot_at, there) + costs.search
        shown = misses.shown(house, container, looks[container])
        knowledge = knowledge.moved(there).seen(container, shown)
        looks[container] += 1
        order.append(container)
        found = any(item.type == item_type for item in shown)
    if found:
        cost += costs.manipulation + _metres(travel, knowledge.robot_at, START)
    return SearchTrial(
        house=house.plan.name,
        item_type=item_type,
        policy=searcher.name + (START_OVER if misses.start_over else ""),
        cost=cost,
        order=tuple(order),
        said=tuple(said),
        found=found,
    )


def chance_to_find(belief: Belief, item_type: ItemType, container: ContainerId) -> float:
    """The probability that the next look into a container finds the item type."""
    return float(belief.of(item_type)[belief.containers.index(container)]) * belief.detects(item_type)


def _metres(travel: TravelCosts, a: LocationId, b: LocationId) -> float:
    return float(travel.metres[travel.index(a), travel.index(b)])
