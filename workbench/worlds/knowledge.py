"""The robot's knowledge: an immutable state that observations and actions advance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from workbench.worlds.house import (
    START,
    ContainerId,
    Contents,
    FloorPlan,
    Item,
    ItemId,
    ItemType,
    LocationId,
)
from workbench.worlds.travel import TravelCosts

Fact = tuple[str, tuple[ItemId, ...]]
"""A property of items established by a preparation: ("boiled", (egg,))."""


@dataclass(slots=True, eq=False)
class _QueryCache:
    """Cache of queries about the same contents; moving the robot, for example, does not invalidate it.

    Attributes:
        items_at, first_seen, closed, again, plan, travel: the immutable inputs that the cached answers depend on,
            compared by identity.
        unsearched, where: cached answers of the methods of the same names.
    """

    items_at: Mapping[LocationId, tuple[Item, ...]] | None = None
    first_seen: Contents | None = None
    closed: frozenset[ContainerId] | None = None
    again: frozenset[ContainerId] | None = None
    plan: FloorPlan | None = None
    travel: TravelCosts | None = None
    unsearched: tuple[ContainerId, ...] | None = None
    where: dict[ItemType, tuple[tuple[LocationId, Item], ...]] = field(
        default_factory=dict[ItemType, tuple[tuple[LocationId, Item], ...]]
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Knowledge:
    """The robot's state and everything it has observed. Planning receives this and never the true house.

    Attributes:
        plan, travel: the floor plan and its travel costs.
        robot_at: the robot's location.
        holding: the item in its hand.
        items_at: per location, the items known to be there now; every searched container has an entry.
        first_seen: contents of each searched container when it was first looked into.
        facts: facts established by preparations, e.g. ("boiled", (egg,)).
        visited: containers searched in this run, in order; those known at the start are not among them.
        closed: containers that could not be searched (a failed look); no longer candidates.
        again: searched containers that are worth another look, since looks can miss; unsearched once more.
    """

    plan: FloorPlan
    travel: TravelCosts
    robot_at: LocationId = START
    holding: Item | None = None
    items_at: Mapping[LocationId, tuple[Item, ...]] = field(default_factory=lambda: MappingProxyType({}))
    first_seen: Contents = field(default_factory=lambda: MappingProxyType({}))
    facts: frozenset[Fact] = frozenset()
    visited: tuple[ContainerId, ...] = ()
    closed: frozenset[ContainerId] = frozenset()
    again: frozenset[ContainerId] = frozenset()
    _asked: _QueryCache = field(default_factory=_QueryCache, repr=False, compare=False)

    def __post_init__(self) -> None:
        asked, plan, travel = self._asked, self.plan, self.travel
        same_place = asked.plan is plan and asked.travel is travel
        same_seen = asked.first_seen is self.first_seen and asked.again is self.again
        same_left = same_place and same_seen and asked.closed is self.closed
        if not same_left or asked.items_at is not self.items_at:
            left = asked.unsearched if same_left else None
            anew = _QueryCache(self.items_at, self.first_seen, self.closed, self.again, plan, travel, left)
            object.__setattr__(self, "_asked", anew)

    @property
    def unsearched(self) -> tuple[ContainerId, ...]:
        """Reachable containers that have not been searched, or are worth another look, in the plan's order."""
        if self._asked.unsearched is None:
            seen, again, closed, reaches = self.first_seen, self.again, self.closed, self.travel.reaches
            names = [c.id for c in self.plan.containers if c.id not in seen or c.id in again]
            left = [c for c in names if c not in closed and reaches(LocationId(c))]
            self._asked.unsearched = tuple(left)
        return self._asked.unsearched

    def where(self, item_type: ItemType) -> tuple[tuple[LocationId, Item], ...]:
        """Known instances of a type with their locations, without the held one, sorted by location."""
        asked = self._asked.where
        if item_type not in asked:
            found = [(at, item) for at, items in self.items_at.items() for item in items if item.type == item_type]
            found.sort(key=lambda pair: pair[0])
            asked[item_type] = tuple(found)
        return asked[item_type]

    def has_known_instance(self, item_type: ItemType) -> bool:
        """Whether the location of some instance is known, including one in the hand."""
        return (self.holding is not None and self.holding.type == item_type) or bool(self.where(item_type))

    def moved(self, location: LocationId) -> Knowledge:
        return self._with(location, self.holding, self.items_at)

    def seen(self, container: ContainerId, items: tuple[Item, ...], *, in_run: bool = True) -> Knowledge:
        """The knowledge after looking into a container, for the first time or again."""
        if container in self.again:
            return self._seen_again(container, items)
        first = MappingProxyType({**self.first_seen, container: items})
        there = MappingProxyType({**self.items_at, LocationId(container): items})
        visited = (*self.visited, container) if in_run else self.visited
        after = self._with(self.robot_at, self.holding, there, first_seen=first, visited=visited)
        if self._asked.unsearched is not None:
            after._asked.unsearched = tuple([c for c in self._asked.unsearched if c != container])
        before = self.items_at.get(LocationId(container), ())
        return after._others_stand_as_in(self, {item.type for item in (*before, *items)})

    def _seen_again(self, container: ContainerId, items: tuple[Item, ...]) -> Knowledge:
        """The knowledge after another look into a searched container: what it shows is added to what is known to be
        there, since a look can miss but not invent."""
        known = self.items_at.get(LocationId(container), ())
        new = tuple(i for i in items if all(i.id != there.id for there in known))
        return replace(
            self,
            items_at=MappingProxyType({**self.items_at, LocationId(container): (*known, *new)}),
            first_seen=MappingProxyType({**self.first_seen, container: (*self.first_seen[container], *new)}),
            visited=(*self.visited, container),
            again=self.again - {container},
        )

    def looks(self, container: ContainerId) -> int:
        """How often the container was looked into in this run."""
        return self.visited.count(container)

    def with_another_look_at(self, containers: frozenset[ContainerId]) -> Knowledge:
        """The knowledge in which these searched containers, and no others, are worth another look."""
        return self if containers == self.again else replace(self, again=containers)

    def shut(self, container: ContainerId) -> Knowledge:
        """The knowledge after a container turned out to be impossible to search."""
        return replace(self, closed=self.closed | {container})

    def picked(self, item: Item) -> Knowledge:
        """The knowledge after picking an item at robot_at."""
        here = self.items_at.get(self.robot_at, ())
        left = tuple([i for i in here if i.id != item.id])
        there = MappingProxyType({**self.items_at, self.robot_at: left})
        gone = {item.type, *[i.type for i in here if i.id == item.id]}
        return self._with(self.robot_at, item, there)._others_stand_as_in(self, gone)

    def placed(self) -> Knowledge:
        """The knowledge after placing the held item at robot_at."""
        if self.holding is None:
            return self
        here = (*self.items_at.get(self.robot_at, ()), self.holding)
        there = MappingProxyType({**self.items_at, self.robot_at: here})
        return self._with(self.robot_at, None, there)._others_stand_as_in(self, {self.holding.type})

    def without_item(self, item: ItemId) -> Knowledge:
        """The knowledge after an item turned out not to be at its known location."""
        there = {loc: tuple(i for i in items if i.id != item) for loc, items in self.items_at.items()}
        return replace(self, items_at=MappingProxyType(there))

    def with_facts(self, facts: frozenset[Fact]) -> Knowledge:
        return replace(self, facts=facts)

    def _others_stand_as_in(self, before: Knowledge, moved: set[ItemType]) -> Knowledge:
        """This knowledge, with cached answers about types that did not move taken over."""
        if self._asked is not before._asked:
            self._asked.where.update([(t, at) for t, at in before._asked.where.items() if t not in moved])
        return self

    def _with(
        self,
        robot_at: LocationId,
        holding: Item | None,
        items_at: Mapping[LocationId, tuple[Item, ...]],
        *,
        first_seen: Contents | None = None,
        visited: tuple[ContainerId, ...] | None = None,
    ) -> Knowledge:
        """A faster dataclasses.replace for the fields that change with every step."""
        return Knowledge(
            plan=self.plan,
            travel=self.travel,
            robot_at=robot_at,
            holding=holding,
            items_at=items_at,
            first_seen=self.first_seen if first_seen is None else first_seen,
            facts=self.facts,
            visited=self.visited if visited is None else visited,
            closed=self.closed,
            again=self.again,
            _asked=self._asked,
        )


def knowledge_at_start(plan: FloorPlan, travel: TravelCosts, known: Contents) -> Knowledge:
    """The knowledge before the first step: the floor plan and the contents of the given containers."""
    knowledge = Knowledge(plan=plan, travel=travel)
    for container in sorted(known):
        knowledge = knowledge.seen(container, tuple(known[container]), in_run=False)
    return knowledge
