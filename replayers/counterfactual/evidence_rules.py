"""Reads a log's events as facts about the place at the start of the run, with one fixed meaning for each odd case.

An item belongs where it was first seen: what the robot put down later is not counted again, and an item seen in two
places without having been carried is read as standing where it was seen first, with a note. Of two looks into one
container the first counts, unless the log says that they could miss: then another look adds what earlier ones did not
show.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from workbench.log_schema.events import ActionFinished, BeliefUpdate, Observation
from workbench.tolerances import NEAR_ROUNDED
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId

LOGGED, IMPLIED, IMPUTED = "logged", "implied", "imputed"
"""What a step of a replay rests on: the run did the very same; it follows from the log and its assumptions; it rests
on a filling of a container that nobody opened."""

OVERLOOKED = "|overlooked|"
"""Marks the id of an item that a recorded look is taken to have overlooked, before its container."""

ELSEWHERE = ""
"""Where an item stood at first that was carried before the log first shows it."""
Leg = tuple[LocationId, LocationId]
Deed = tuple[str, LocationId, tuple[ItemId, ...]]
"""A manipulation: its kind, its place, its items."""


def contents_at_start(
    observations: Iterable[Observation], actions: Iterable[ActionFinished], containers: tuple[ContainerId, ...]
) -> tuple[dict[ContainerId, tuple[Item, ...]], tuple[str, ...]]:
    """Contents of each searched container at the start of the run, and notes on what was odd."""
    handled = _first_handled(actions)
    home: dict[str, str] = {}
    contents: dict[ContainerId, tuple[Item, ...]] = {}
    notes: dict[str, None] = {}
    for seen in sorted(observations, key=lambda o: (o.stamp.ns, o.decision)):
        container = ContainerId(seen.container)
        if container not in containers:
            notes[f"{container} was searched but is not a container of this place; left out"] = None
            continue
        again = container in contents
        items: list[Item] = []
        for item in seen.items:
            carried = item.id in handled and handled[item.id] <= seen.stamp.ns
            first = home.setdefault(item.id, ELSEWHERE if carried else seen.container)
            if first != seen.container and not carried:
                notes[f"{item.id} was seen in {first} and in {container}; it is read as standing in {first}"] = None
            if first == seen.container and not any(i.id == item.id for i in items):
                items.append(Item(id=ItemId(item.id), type=ItemType(item.type)))
        if not again:
            contents[container] = tuple(items)
        elif seen.look is not None:  # a look that can miss: another one adds what it overlooked
            contents[container] = tuple({i.id: i for i in (*contents[container], *items)}.values())
        elif not {i.id for i in items} <= {i.id for i in contents[container]}:
            notes[f"{container} was searched twice with different contents; the first search counts"] = None
    return contents, tuple(notes)


def picked_without_look(
    observations: Iterable[Observation], actions: Iterable[ActionFinished], containers: tuple[ContainerId, ...]
) -> dict[ContainerId, tuple[Item, ...]]:
    """Items that were picked up in a container before any look into it, and that nothing had moved before: they stood
    there at the start of the run."""
    looked: dict[str, int] = {}
    seen: dict[str, int] = {}
    for o in observations:
        looked[o.container] = min(o.stamp.ns, looked.get(o.container, o.stamp.ns))
        for item in o.items:
            seen[item.id] = min(o.stamp.ns, seen.get(item.id, o.stamp.ns))
    handled = _first_handled(actions)
    found: dict[ContainerId, tuple[Item, ...]] = {}
    for action in actions:
        container = ContainerId(action.target)
        if action.action != "pick" or not action.success or container not in containers:
            continue
        for item, item_type in zip(action.items, action.item_types, strict=False):
            unlooked = looked.get(container, action.start.ns + 1) > action.start.ns
            unseen = seen.get(item, action.start.ns + 1) > action.start.ns
            if unlooked and unseen and handled[item] == action.stamp.ns:
                here = Item(id=ItemId(item), type=ItemType(item_type))
                found[container] = (*found.get(container, ()), here)
    return found


def refused_looks(
    actions: Iterable[ActionFinished], contents: Mapping[ContainerId, object]
) -> Mapping[ContainerId, str]:
    """Containers whose searches were all refused, with the reason."""
    failed = {
        ContainerId(a.target): a.reason or "it could not be searched"
        for a in actions
        if a.action == "search" and not a.success and a.target not in contents
    }
    return MappingProxyType(failed)


def refused_targets(actions: Iterable[ActionFinished], action: str) -> dict[str, str]:
    """Targets of moves, or items of picks, of which every recorded attempt was refused, with the reason."""
    attempts = [a for a in actions if a.action == action and (action == "move" or a.items)]
    key = {id(a): a.target if action == "move" else a.items[0] for a in attempts}
    worked = {key[id(a)] for a in attempts if a.success}
    return {key[id(a)]: a.reason or "it was refused" for a in attempts if not a.success and key[id(a)] not in worked}


def items_left_in_place(actions: Iterable[ActionFinished]) -> frozenset[ItemId]:
    """Items that were never picked although every pick of them left them where they were, as a failed grasp does."""
    picks = [a for a in actions if a.action == "pick" and a.items]
    gone = {a.items[0] for a in picks if a.success or not a.item_remains}
    return frozenset(ItemId(a.items[0]) for a in picks if a.items[0] not in gone)


def successful_manipulations(actions: Iterable[ActionFinished]) -> frozenset[Deed]:
    """The manipulations that succeeded: kind, place, items."""
    return frozenset(
        (a.action, LocationId(a.target), tuple(ItemId(i) for i in a.items))
        for a in actions
        if a.success and a.action not in ("move", "search")
    )


def first_belief(
    beliefs: Iterable[BeliefUpdate], containers: tuple[ContainerId, ...], *, rounded: bool = False
) -> tuple[Mapping[tuple[str, str], float], bool, tuple[str, ...]]:
    """The first logged probability of each (item type, container); whether it stayed; notes on strange containers.

    Args:
        rounded: the log holds six decimals, so that what differs in the last of them may be the same.
    """
    near = NEAR_ROUNDED if rounded else 0.0
    first: dict[tuple[str, str], float] = {}
    static_beliefs = True
    strange: dict[str, None] = {}
    for update in beliefs:
        for item_type, row in zip(update.item_types, update.probability, strict=False):
            for container, probability in zip(update.containers, row, strict=False):
                if container not in containers:
                    strange[f"the log has a belief for {container}, which this place does not have; left out"] = None
                    continue
                before = first.setdefault((item_type, container), probability)
                static_beliefs = static_beliefs and abs(before - probability) <= near
    return MappingProxyType(first), static_beliefs, tuple(strange)


def looks_in_order(observations: Iterable[Observation]) -> Mapping[ContainerId, tuple[tuple[Item, ...], ...]]:
    """What each look of the run showed, container by container in the order of the looks."""
    looks: dict[ContainerId, list[tuple[Item, ...]]] = {}
    for seen in sorted(observations, key=lambda o: (o.stamp.ns, o.decision)):
        if not seen.known_at_start:
            items = tuple(Item(id=ItemId(i.id), type=ItemType(i.type)) for i in seen.items)
            looks.setdefault(ContainerId(seen.container), []).append(items)
    return MappingProxyType({container: tuple(shown) for container, shown in looks.items()})


def seen_from_start(observations: Iterable[Observation]) -> Mapping[ContainerId, Pose]:
    """The containers that were in view from the start pose, with that pose."""
    poses = ((ContainerId(o.container), o.passing.viewpoint) for o in observations if o.known_at_start and o.passing)
    return MappingProxyType(
        {container: Pose(x_m=at[0], y_m=at[1], yaw_rad=at[2]) for container, at in poses if len(at) == 3}
    )


def chances_of_missing(
    observations: Iterable[Observation], *, independent: bool
) -> Mapping[tuple[ItemType, ContainerId], float]:
    """Per item type and container, the chance that every look there missed it, as the log assumes.

    Args:
        independent: every look counts, as in simulation; otherwise looks from one viewpoint count once, since what
            one of them misses the others miss as well (Velez et al., JAIR 44, 2012).
    """
    chances: dict[tuple[ItemType, ContainerId], float] = {}
    counted: set[tuple[str, tuple[float, ...]]] = set()
    for seen in observations:
        look = seen.look
        if look is None or (not independent and look.viewpoint and (seen.container, look.viewpoint) in counted):
            continue
        counted.add((seen.container, look.viewpoint))
        for item_type, p in zip(look.item_types, look.p_detect, strict=True):
            key = ItemType(item_type), ContainerId(seen.container)
            chances[key] = chances.get(key, 1.0) * (1.0 - p)
    return MappingProxyType(chances)


def _first_handled(actions: Iterable[ActionFinished]) -> dict[str, int]:
    """When each item was first picked up or put down, in nanoseconds since the epoch."""
    handled: dict[str, int] = {}
    for action in actions:
        if action.action in ("pick", "place") and action.success:
            for item in action.items:
                handled.setdefault(item, action.stamp.ns)
    return handled
