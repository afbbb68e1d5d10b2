"""What containers held at the start of a run, by the looks of its log.

An item belongs where it was first seen: what the robot put down later is not counted again, and an item seen in two
places without having been carried is read as standing where it was seen first, with a note. What a later look into a
container adds to earlier ones stood there from the start: the earlier ones missed it, which is noted unless the log
says that looks could miss.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from workbench.log_schema.events import ActionFinished, GroundTruth, ItemSighting, Observation
from workbench.worlds.house import ContainerId, FloorPlan, House, Item, ItemId, ItemType

ELSEWHERE = ""
"""Where an item stood at first that was carried before the log first shows it."""


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
            continue
        earlier = {i.id: i for i in contents[container]}
        contents[container] = tuple({**earlier, **{i.id: i for i in items if i.id not in earlier}}.values())
        if seen.look is None:
            missed = (i.id for i in items if i.id not in earlier)
            notes |= {
                f"{i} was shown by a later look into {container} only: earlier ones missed it": None for i in missed
            }
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


def sighted_at_start(
    sightings: Iterable[ItemSighting],
    actions: Iterable[ActionFinished],
    contents: Mapping[ContainerId, tuple[Item, ...]],
    containers: tuple[ContainerId, ...],
) -> tuple[dict[ContainerId, tuple[Item, ...]], tuple[str, ...]]:
    """Items that were seen in passing before anything had moved them, by the container in which each was seen first:
    they stood there at the start of the run. With notes on what looks say otherwise.

    Args:
        contents: of the containers that were looked into, by the looks: one that shows such an item elsewhere is
            believed, one that does not show it there missed it.
    """
    handled = _first_handled(actions)
    looked = {item.id: container for container, items in contents.items() for item in items}
    found: dict[ContainerId, tuple[Item, ...]] = {}
    notes: dict[str, None] = {}
    placed: set[str] = set()
    for seen in sorted(sightings, key=lambda s: (s.stamp.ns, s.decision)):
        item, container = Item(id=ItemId(seen.item.id), type=ItemType(seen.item.type)), ContainerId(seen.container)
        moved = item.id in handled and handled[item.id] <= seen.stamp.ns
        if container not in containers or moved or item.id in placed:
            continue
        placed.add(item.id)
        if looked.get(item.id, container) != container:
            elsewhere = f"{item.id} was seen in {container} in passing, and by a look in {looked[item.id]}"
            notes[f"{elsewhere}; it is read as standing there"] = None
            continue
        if item.id in looked:
            continue
        found[container] = (*found.get(container, ()), item)
        if container in contents and item.id not in handled:
            notes[f"{item.id} was seen in {container} in passing; the look into it missed it"] = None
        elif container not in contents:
            there = f"{item.id} was seen in {container} in passing: it stood there at the start"
            notes[f"{there}, and what else lies there is open"] = None
    return found, tuple(notes)


def _first_handled(actions: Iterable[ActionFinished]) -> dict[str, int]:
    """When each item was first picked up or put down, in nanoseconds since the epoch."""
    handled: dict[str, int] = {}
    for action in actions:
        if action.action in ("pick", "place") and action.success:
            for item in action.items:
                handled.setdefault(item, action.stamp.ns)
    return handled


def house_from_truth(plan: FloorPlan, truth: GroundTruth) -> House:
    """The house of a recorded truth, by its containers' true contents."""
    contents = {
        ContainerId(c): tuple(Item(id=ItemId(i.id), type=ItemType(i.type)) for i in items)
        for c, items in truth.contents.items()
    }
    return House(plan=plan, contents=contents)
