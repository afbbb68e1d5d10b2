"""Reads a log's events as facts about the place at the start of the run, with one fixed meaning for each odd case."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from workbench.log_schema.events import ActionFinished, BeliefUpdate, ItemSighting, Observation, PlanComputed
from workbench.tolerances import NEAR_ROUNDED
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.perception import viewpoint_square
from workbench.worlds.world import ItemInPassing

LOGGED, IMPLIED, IMPUTED = "logged", "implied", "imputed"
"""What a step of a replay rests on: the run did the very same; it follows from the log and its assumptions; it rests
on a filling of a container that nobody opened."""

OVERLOOKED = "|overlooked|"
"""Marks the id of an item that a recorded look is taken to have overlooked, before its container."""

Leg = tuple[LocationId, LocationId]
Deed = tuple[str, LocationId, tuple[ItemId, ...]]
"""A manipulation: its kind, its place, its items."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenOnMove:
    """Single items that were seen in passing on one move, where that move ended, and where it was to lead."""

    items: tuple[ItemInPassing, ...]
    end: LocationId
    way: Leg


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
    static_beliefs, known = True, frozenset(containers)
    strange: dict[str, None] = {}
    for update in beliefs:
        for item_type, row in zip(update.item_types, update.probability, strict=False):
            for container, probability in zip(update.containers, row, strict=False):
                if container not in known:
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


def seen_on_moves(
    sightings: Iterable[ItemSighting], actions: Iterable[ActionFinished], plans: Iterable[PlanComputed]
) -> Mapping[int, SeenOnMove]:
    """What was seen in passing on the moves of a run, by the number of the move, refused ones counted."""
    goals = {plan.decision: plan.search_order[0].container for plan in plans if plan.search_order}
    moves = sorted((a for a in actions if a.action == "move"), key=lambda a: a.index)
    left = sorted(sightings, key=lambda s: (s.stamp.ns, s.decision))
    found: dict[int, SeenOnMove] = {}
    for number, move in enumerate(moves):
        items = tuple(_in_passing(s) for s in left if s.decision == move.decision and s.stamp <= move.stamp)
        left = [s for s in left if not (s.decision == move.decision and s.stamp <= move.stamp)]
        if items and move.success:
            way = LocationId(move.origin), LocationId(goals.get(move.decision, move.target))
            found[number] = SeenOnMove(items=items, end=LocationId(move.target), way=way)
    return MappingProxyType(found)


def _in_passing(seen: ItemSighting) -> ItemInPassing:
    x_m, y_m, yaw_rad = seen.viewpoint if len(seen.viewpoint) == 3 else (0.0, 0.0, 0.0)
    return ItemInPassing(
        stamp_ns=seen.stamp.ns,
        container=ContainerId(seen.container),
        item=Item(id=ItemId(seen.item.id), type=ItemType(seen.item.type)),
        viewpoint=Pose(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad),
        support=LOGGED,
    )


def chances_of_missing(
    observations: Iterable[Observation], *, independent: bool
) -> Mapping[tuple[ItemType, ContainerId], float]:
    """Per item type and container, the chance that every look there missed it, as the log assumes.

    Args:
        independent: every look counts, as in simulation; otherwise looks from one viewpoint
            (viewpoint_square) count once, since what one of them misses the others miss as well (Velez et al.,
            JAIR 44, 2012).
    """
    chances: dict[tuple[ItemType, ContainerId], float] = {}
    counted: set[tuple[str, tuple[int, int] | None]] = set()
    for seen in observations:
        look = seen.look
        if look is None:
            continue
        square = viewpoint_square(*look.viewpoint[:2]) if look.viewpoint else None
        if not independent and square is not None and (seen.container, square) in counted:
            continue
        counted.add((seen.container, square))
        for item_type, p in zip(look.item_types, look.p_detect, strict=True):
            key = ItemType(item_type), ContainerId(seen.container)
            chances[key] = chances.get(key, 1.0) * (1.0 - p)
    return MappingProxyType(chances)
