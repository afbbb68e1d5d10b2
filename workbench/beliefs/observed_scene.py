"""A house and what the robot has observed in it, as the arrays that features are computed from.

Every number belongs to a container, and the features of `context.py` use only sums over containers, so that a
belief cannot depend on their order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import Bools, Floats, Ints
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan
from workbench.worlds.knowledge import Knowledge

ROOM_KINDS = ("Bathroom", "Bedroom", "Kitchen", "LivingRoom")
"""ProcTHOR's room kinds; other kinds have no feature of their own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedScene:
    """A plan's containers as arrays.

    Attributes:
        kinds, types: room kind and container type of each container.
        room: int64, shape (containers,), the index of its room.
        size_m: float64, shape (containers, 3).
        rooms: the kinds of all rooms.
        room_m2: float64, shape (rooms,), floor areas.
        stands: per room, the types of furniture that is not a container, such as a plant or a television.
        open: bool, shape (containers,): whether it can still be searched.
        seen: per container, the types observed in it; None if it was not searched.
    """

    kinds: tuple[str, ...]
    types: tuple[str, ...]
    room: Ints
    size_m: Floats
    rooms: tuple[str, ...]
    room_m2: Floats
    stands: tuple[tuple[str, ...], ...]
    open: Bools
    seen: tuple[tuple[str, ...] | None, ...]


def scene_of(knowledge: Knowledge) -> ObservedScene:
    """The scene as the robot knows it now."""
    plan = knowledge.plan
    unsearched = set(knowledge.unsearched)
    first = knowledge.first_seen
    seen = tuple(tuple(i.type for i in first[c.id]) if c.id in first else None for c in plan.containers)
    return scene_from(plan, is_open=[c.id in unsearched for c in plan.containers], seen=seen)


def scene_from(plan: FloorPlan, *, is_open: list[bool], seen: tuple[tuple[str, ...] | None, ...]) -> ObservedScene:
    """The scene of a plan with given unsearched containers and observations, in the plan's order."""
    at = {room.id: k for k, room in enumerate(plan.rooms)}
    kinds = tuple(room.kind for room in plan.rooms)
    room = np.array([at[c.room] for c in plan.containers], dtype=np.int64)
    return ObservedScene(
        kinds=tuple(kinds[k] for k in room),
        types=tuple(c.type for c in plan.containers),
        room=room,
        size_m=np.array([c.size_m for c in plan.containers], dtype=np.float64).reshape(-1, 3),
        rooms=kinds,
        room_m2=np.array([_area_m2(r.floor) for r in plan.rooms]),
        stands=furniture_types(plan),
        open=np.array(is_open, dtype=bool),
        seen=seen,
    )


def furniture_types(plan: FloorPlan) -> tuple[tuple[str, ...], ...]:
    """For each room, the types of its furniture that is no container, sorted."""
    return tuple(tuple(sorted({f.type for f in plan.furniture if f.room == room.id})) for room in plan.rooms)


def _area_m2(floor: tuple[Point, ...]) -> float:
    """Of a simple polygon (the shoelace formula)."""
    around = zip(floor, (*floor[1:], floor[0]), strict=True)
    return 0.5 * abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in around))
