"""A lower bound: the least that must still be paid to meet the goal in any world that is consistent with the log.

It holds for every strategy: each missing delivery must at least be carried from the best place where its item can be.
Travel costs are the shortest paths over the logged costs, so that the bound also holds where a logged matrix violates
the triangle inequality. Infinite where no world can meet the goal any more: the run then fails.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from math import inf
from typing import final

from replayers.counterfactual.bounds.travel_row import travel_row
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Relevance
from workbench.arrays import Floats
from workbench.caches import Cache, PerObject
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.tolerances import ROUNDING_SHARE
from workbench.worlds.house import ContainerId, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.travel import shortest_paths

Containers = tuple[ContainerId, ...]

MAX_CACHED_PARTS = 50_000
"""Bounds of single parts in the cache; beyond this, it is cleared."""


def shortest_ways(evidence: Evidence) -> Floats:
    """The least metres between the locations of a log, shape (locations, locations), where a way may lead through
    others; found once."""
    travel = evidence.place.travel
    return _SHORTEST.of(travel).get((), lambda: shortest_paths(travel.metres) * (1 - ROUNDING_SHARE))


_SHORTEST: PerObject[tuple[()], Floats] = PerObject(2)


@final
class LowerBound:
    """The lower bound for one log and one task, in metres and their equivalents."""

    def __init__(self, evidence: Evidence, relevance: Relevance) -> None:
        travel = evidence.place.travel
        self._evidence = evidence
        self._relevance = relevance
        self._index = {name: i for i, name in enumerate(travel.locations)}
        self._metres = shortest_ways(evidence)
        self._from: list[list[float]] = self._metres.tolist()
        self._to: list[list[float]] = self._metres.T.tolist()
        self._handle = evidence.costs.manipulation
        self._may = frozenset(relevance.types)
        self._open = tuple(LocationId(c) for c in evidence.open)
        self._doubtful = tuple(LocationId(c) for c in evidence.doubtful)
        self._unknown: Containers = (*evidence.contents, *evidence.open)
        self._parts: Cache[Hashable, tuple[float, float]] = Cache(MAX_CACHED_PARTS)
        self._logged: dict[ItemType, list[tuple[LocationId, ContainerId, ItemId]]] = {}
        for container, items in (*evidence.contents.items(), *evidence.partly.items()):
            for item in items:
                if LocationId(container) in self._index:
                    self._logged.setdefault(item.type, []).append((LocationId(container), container, item.id))

    def remaining_cost(self, knowledge: Knowledge) -> float:
        """The least that is still to pay from a state on; infinite when the goal cannot be met any more."""
        left = tuple([c for c in self._unknown if c not in knowledge.first_seen])
        return self._least(self._evidence.task.goal, knowledge, left)

    def certainly_possible(self, knowledge: Knowledge) -> bool:
        """Whether every world that is consistent with the log still has, within reach, all that the goal needs."""
        return self._certain(self._evidence.task.goal, knowledge, Counter())

    def _least(self, goal: Goal, knowledge: Knowledge, left: Containers) -> float:
        """left: containers that this run has not looked into yet."""
        if isinstance(goal, AnyOf):
            return min((self._least(part, knowledge, left) for part in goal.parts), default=0.0)
        if isinstance(goal, AllOf):
            least, loaded = 0.0, 0.0  # loaded ways and manipulations add up: there is one hand
            for part in goal.parts:
                if isinstance(part, AllOf | AnyOf):
                    least = max(least, self._least(part, knowledge, left))
                    continue
                cost, carried = self._part_cost(part, knowledge, left)
                least = max(least, cost)
                loaded += carried if isinstance(part, Delivered) else 0.0
            return max(least, loaded)
        return self._part_cost(goal, knowledge, left)[0]

    def _part_cost(self, part: Delivered | Holding, knowledge: Knowledge, left: Containers) -> tuple[float, float]:
        """The least that one part alone costs from here, and the loaded share of it. Siblings differ in few parts."""
        held = knowledge.holding is not None and knowledge.holding.type == part.item_type
        doubtful = self._evidence.misses_left(knowledge) > 0
        key = part, knowledge.robot_at, held, knowledge.where(part.item_type), knowledge.facts, left, doubtful
        return self._parts.get(key, lambda: self._bound(part, knowledge, held=held))

    def _bound(self, part: Delivered | Holding, knowledge: Knowledge, *, held: bool) -> tuple[float, float]:
        if is_met(part, knowledge):
            return 0.0, 0.0
        here, to = self._metres_from(knowledge), self._index.get(part.at)
        if here is None or to is None:
            return inf, inf
        place = self._handle if isinstance(part, Delivered) else 0.0
        if held:
            return here[to] + place, self._handle
        at = self._sources(part.item_type, knowledge)
        if not at:
            return inf, inf
        carried = self._to[to]
        least = min([here[i] + carried[i] for i in at]) + self._handle + place
        if isinstance(part, Delivered) and to in at:
            return min(least, here[to]), 0.0
        return least, min([carried[i] for i in at]) + 2 * self._handle

    def _metres_from(self, knowledge: Knowledge) -> list[float] | None:
        """Metres from where the robot is to every location; None if there is no way."""
        at = self._index.get(knowledge.robot_at)
        if at is not None:
            return self._from[at]
        row = travel_row(knowledge, self._index, self._metres, share=1 - ROUNDING_SHARE)
        return None if row is None else row.tolist()

    def _sources(self, item_type: ItemType, knowledge: Knowledge) -> list[int]:
        """Location indices of where an instance may stand: known, shown by the log in a container that this run has
        not searched yet, or in one that is still open."""
        index, seen = self._index, knowledge.first_seen
        at = [index[place] for place, _ in knowledge.where(item_type) if place in index]
        at += [index[place] for place, container, _ in self._logged.get(item_type, ()) if container not in seen]
        if item_type in self._may:
            at += [index[place] for place in self._may_hold_more(knowledge) if place in index]
        return at

    def _may_hold_more(self, knowledge: Knowledge) -> list[LocationId]:
        """Containers left that may hold what the log does not show: open ones, and, while items may have been
        overlooked, those that were looked into."""
        seen = knowledge.first_seen
        left = [c for c in self._open if c not in seen]
        if self._doubtful and self._evidence.misses_left(knowledge) > 0:
            left += [c for c in self._doubtful if c not in seen]
        return left

    def _certain(self, goal: Goal, knowledge: Knowledge, taken: Counter[ItemType]) -> bool:
        """Parts of an AllOf need an instance each; the first part to be asked takes the first."""
        if isinstance(goal, AnyOf):
            return any(self._certain(part, knowledge, taken.copy()) for part in goal.parts)
        if isinstance(goal, AllOf):
            return all(self._certain(part, knowledge, taken) for part in goal.parts)
        if (isinstance(goal, Delivered) and goal.properties) or goal.at not in self._index:
            return False
        taken[goal.item_type] += 1
        return taken[goal.item_type] <= self._certain_instances(goal.item_type, knowledge)

    def _certain_instances(self, item_type: ItemType, knowledge: Knowledge) -> int:
        no_pick, no_move = self._evidence.refused_picks, self._evidence.refused_moves
        held = knowledge.holding is not None and knowledge.holding.type == item_type
        seen, known, logged = knowledge.first_seen, knowledge.where(item_type), self._logged.get(item_type, ())
        places = [(at, item.id) for at, item in known if at in self._index]
        places += [(at, item) for at, container, item in logged if container not in seen]
        count = len([1 for at, item in places if at not in no_move and item not in no_pick]) + held
        if count == 0 and item_type in self._relevance.must_exist and not self._relevance.hidden:
            return int(bool(self._may_hold_more(knowledge)))
        return count
