"""The robot's knowledge: an immutable state that observations and actions advance."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import NamedTuple, TypeVar

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

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")

Fact = tuple[str, tuple[ItemId, ...]]
"""A property of items established by a preparation: ("boiled", (egg,))."""


Places = tuple[tuple[LocationId, Item], ...]
"""Instances of a type with their locations, sorted by location."""


class _Derived(NamedTuple):
    """What follows from a part of the knowledge, so that most steps need not work it out again.

    Attributes:
        items_at, first_seen, closed, again, plan, travel: what it follows from, compared by identity.
        unsearched: as Knowledge.unsearched. by_type: as Knowledge.where, for every type that is known somewhere.
    """

    items_at: Mapping[LocationId, tuple[Item, ...]]
    first_seen: Contents
    closed: frozenset[ContainerId]
    again: frozenset[ContainerId]
    plan: FloorPlan
    travel: TravelCosts
    unsearched: tuple[ContainerId, ...]
    by_type: Mapping[ItemType, Places]


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
        visited: containers searched in this run, or seen in passing, in order; those known at the start are not among
            them.
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
    _derived: _Derived | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        known, plan, travel = self._derived, self.plan, self.travel
        same_items = known is not None and known.items_at is self.items_at
        same_left = (
            known is not None
            and known.first_seen is self.first_seen
            and known.closed is self.closed
            and known.again is self.again
            and known.plan is plan
            and known.travel is travel
        )
        if known is None or not same_items or not same_left:
            left = known.unsearched if known is not None and same_left else self._not_searched()
            by_type = known.by_type if known is not None and same_items else _by_type(self.items_at)
            made = _Derived(self.items_at, self.first_seen, self.closed, self.again, plan, travel, left, by_type)
            object.__setattr__(self, "_derived", made)

    @property
    def unsearched(self) -> tuple[ContainerId, ...]:
        """Reachable containers that have not been searched, or are worth another look, in the plan's order."""
        return self._known.unsearched

    def where(self, item_type: ItemType) -> tuple[tuple[LocationId, Item], ...]:
        """Known instances of a type with their locations, without the held one, sorted by location."""
        derived = self._derived
        assert derived is not None, "made in __post_init__"
        return derived.by_type.get(item_type, ())

    @property
    def known_types(self) -> frozenset[ItemType]:
        """The types of all items whose location is known, without the held one."""
        return frozenset(item.type for items in self.items_at.values() for item in items)

    def has_known_instance(self, item_type: ItemType) -> bool:
        """Whether the location of some instance is known, including one in the hand."""
        return (self.holding is not None and self.holding.type == item_type) or bool(self.where(item_type))

    def moved(self, location: LocationId) -> Knowledge:
        return self._with(location, self.holding, self.items_at)

    def seen(self, container: ContainerId, items: tuple[Item, ...], *, in_run: bool = True) -> Knowledge:
        """The knowledge after looking into a container, for the first time or again.

        What the robot itself has put there is still there, though a look may miss it.
        """
        if container in self.again:
            return self._seen_again(container, items)
        first = _but(self.first_seen, container, items)
        put = self.items_at.get(LocationId(container), ())
        if put:
            shown = {item.id for item in items}
            items = (*items, *(item for item in put if item.id not in shown))
        there = _but(self.items_at, LocationId(container), items)
        visited = (*self.visited, container) if in_run else self.visited
        return self._with(
            self.robot_at,
            self.holding,
            there,
            LocationId(container),
            dict.fromkeys([item.type for item in items]),
            first_seen=first,
            visited=visited,
            searched=container,
        )

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

    def sighted(self, container: ContainerId, item: Item) -> Knowledge:
        """The knowledge after seeing one item in a container in passing: what else is there stays as it was known.

        In a container that was searched, the looks before missed it.
        """
        left = {at: tuple(i for i in items if i.id != item.id) for at, items in self.items_at.items()}
        place, first = LocationId(container), self.first_seen
        if container in first and all(i.id != item.id for i in first[container]):
            first = MappingProxyType({**first, container: (*first[container], item)})
        there = MappingProxyType({**left, place: (*left.get(place, ()), item)})
        return replace(self, items_at=there, first_seen=first)

    def knows(self, item: Item) -> bool:
        """Whether it is known where an item is, in the hand or elsewhere."""
        held = self.holding is not None and self.holding.id == item.id
        return held or any(one.id == item.id for _, one in self.where(item.type))

    def left_in(self, container: ContainerId, items: tuple[Item, ...]) -> tuple[Item, ...]:
        """Those of the items that a container held at first which the robot has not taken out of it."""
        moved = {item.id for at, there in self.items_at.items() if at != container for item in there}
        moved |= set() if self.holding is None else {self.holding.id}
        return tuple(item for item in items if item.id not in moved)

    def looks(self, container: ContainerId) -> int:
        """How often the container was looked into in this run."""
        return self.visited.count(container)

    def with_another_look_at(self, containers: frozenset[ContainerId]) -> Knowledge:
        """The knowledge in which these searched containers, and no others, are worth another look."""
        return self if containers == self.again else replace(self, again=containers)

    def refuse_search(self, container: ContainerId) -> Knowledge:
        """The knowledge after a container turned out to be impossible to search."""
        return replace(self, closed=self.closed | {container})

    def picked(self, item: Item) -> Knowledge:
        """The knowledge after picking an item at robot_at."""
        here = self.items_at.get(self.robot_at, ())
        left = tuple([i for i in here if i.id != item.id])
        there = _but(self.items_at, self.robot_at, left)
        return self._with(self.robot_at, item, there, self.robot_at, (item.type,))

    def placed(self) -> Knowledge:
        """The knowledge after placing the held item at robot_at."""
        if self.holding is None:
            return self
        here = (*self.items_at.get(self.robot_at, ()), self.holding)
        there = _but(self.items_at, self.robot_at, here)
        return self._with(self.robot_at, None, there, self.robot_at, (self.holding.type,))

    def brought(self, item: Item, origin: LocationId, target: LocationId) -> Knowledge:
        """The knowledge after bringing an item from where it is known to be to another place, with an empty hand: as
        moving to the one, picking it, moving to the other and placing it."""
        left = tuple([i for i in self.items_at.get(origin, ()) if i.id != item.id])
        here = (*self.items_at.get(target, ()), item)
        there = _but(_but(self.items_at, origin, left), target, here)
        taken = _by_type_after(self._known.by_type, origin, left, (item.type,))
        return self._with(target, None, there, target, (item.type,), by_type=taken)

    def without_item(self, item: ItemId) -> Knowledge:
        """The knowledge after an item turned out not to be at its known location."""
        there = {loc: tuple(i for i in items if i.id != item) for loc, items in self.items_at.items()}
        return replace(self, items_at=MappingProxyType(there))

    def with_facts(self, facts: frozenset[Fact]) -> Knowledge:
        return replace(self, facts=facts)

    @property
    def _known(self) -> _Derived:
        if self._derived is None:
            raise AssertionError("made in __post_init__")
        return self._derived

    def _not_searched(self) -> tuple[ContainerId, ...]:
        seen, again, closed, reaches = self.first_seen, self.again, self.closed, self.travel.reaches
        names = [c.id for c in self.plan.containers if c.id not in seen or c.id in again]
        return tuple([c for c in names if c not in closed and reaches(LocationId(c))])

    def _with(
        self,
        robot_at: LocationId,
        holding: Item | None,
        items_at: Mapping[LocationId, tuple[Item, ...]],
        changed: LocationId | None = None,
        types: Collection[ItemType] = (),
        *,
        first_seen: Contents | None = None,
        visited: tuple[ContainerId, ...] | None = None,
        searched: ContainerId | None = None,
        by_type: Mapping[ItemType, Places] | None = None,
    ) -> Knowledge:
        """A faster dataclasses.replace for the fields that change with every step; nothing is checked again.

        Args:
            changed: the one location whose items differ from before.
            types: of the items that differ there.
            searched: the container that first_seen has beyond before.
            by_type: as of _Derived, before the items there changed; None for this knowledge's.
        """
        first = self.first_seen if first_seen is None else first_seen
        derived = self._known
        if changed is not None:
            left = derived.unsearched
            if searched is not None:
                left = tuple([c for c in left if c != searched])
            known = derived.by_type if by_type is None else by_type
            by_type = _by_type_after(known, changed, items_at[changed], types)
            derived = _Derived(items_at, first, self.closed, self.again, self.plan, self.travel, left, by_type)
        made = object.__new__(Knowledge)
        at_once = (self.plan, self.travel, robot_at, holding, items_at, first, self.facts)
        visited = self.visited if visited is None else visited
        for fill, value in zip(_SLOTS, (*at_once, visited, self.closed, self.again, derived), strict=True):
            fill(made, value)
        return made


_SLOTS: tuple[Callable[[Knowledge, object], None], ...] = tuple(
    getattr(Knowledge, each.name).__set__ for each in fields(Knowledge)
)
"""They fill in the fields of a new one, in order."""


def _but(mapping: Mapping[K, V], key: K, value: V) -> Mapping[K, V]:
    """The same mapping, but for one entry."""
    changed = dict(mapping) if not isinstance(mapping, MappingProxyType) else mapping.copy()  # three times as fast
    changed[key] = value
    return MappingProxyType(changed)


def _by_type(items_at: Mapping[LocationId, tuple[Item, ...]]) -> Mapping[ItemType, Places]:
    found: dict[ItemType, list[tuple[LocationId, Item]]] = {}
    for at in sorted(items_at):
        for item in items_at[at]:
            found.setdefault(item.type, []).append((at, item))
    return MappingProxyType({item_type: tuple(places) for item_type, places in found.items()})


def _by_type_after(
    by_type: Mapping[ItemType, Places], at: LocationId, now: tuple[Item, ...], types: Collection[ItemType]
) -> Mapping[ItemType, Places]:
    """The instances of each type after the items of these types changed at one location."""
    if not types:
        return by_type
    found = dict(by_type) if not isinstance(by_type, MappingProxyType) else by_type.copy()
    for item_type in types:
        there = [(at, item) for item in now if item.type == item_type]
        places = by_type.get(item_type)
        if places:
            there = [*[p for p in places if p[0] < at], *there, *[p for p in places if p[0] > at]]
        found[item_type] = tuple(there)
    return MappingProxyType(found)


def knowledge_at_start(plan: FloorPlan, travel: TravelCosts, known: Contents) -> Knowledge:
    """The knowledge before the first step: the floor plan and the contents of the given containers."""
    first = {container: tuple(known[container]) for container in sorted(known)}
    there = {LocationId(container): items for container, items in first.items()}
    return Knowledge(plan=plan, travel=travel, items_at=MappingProxyType(there), first_seen=MappingProxyType(first))
