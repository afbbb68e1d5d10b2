"""Reachability of rooms and containers in a floor plan, what joins the rooms, and why some are cut off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.message_enum import MessageEnum, Result
from workbench.worlds.house import ContainerId, FloorPlan, RoomId
from workbench.worlds.maps.connectivity import rooms_beside
from workbench.worlds.maps.navigation import REACH_M, Navigation, clear_cells, free_cells
from workbench.worlds.maps.occupancy import occupancy_of, room_labels

Passage = Literal["door", "open wall"]

CUT_OFF_SHARE = 0.5
"""A room of whose clear floor less than this is reached is cut off: the sill of its door alone is no room."""
FINER_M = 0.05
"""The finer grid on which a room that is cut off is tried again, in metres a cell."""
ROBOT_RADIUS_M = 0.2


class RoomAccess(MessageEnum):
    """Whether a room and its containers are reached, and if not, why."""

    WHOLE = ""
    GRID_TOO_COARSE = "only on the grid: at {cell_m} m a cell the robot fits"
    TOO_NARROW = "the way is narrower than the robot, {width_m} m"
    NO_WAY_IN = "furniture or walls leave no way in"
    NO_FREE_FLOOR = "no free floor in the room within {reach_m} m, for a robot of {radius_m} m radius"


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomReach:
    """How a room is joined to others, and how much of it the robot reaches.

    Attributes:
        joined: the rooms beside it that doors or open walls lead to, with by what, sorted.
        free_m2: floor on which the robot's centre can be, in the largest connected part of the house.
        cut_off: whether that is less than half of the room's clear floor, or there is none.
        containers: number of containers in the room.
        unreachable: those that the robot cannot use.
        access: whether all is reached; if not, why the room is cut off, or why some containers cannot be used.
    """

    room: RoomId
    kind: str
    joined: tuple[tuple[RoomId, Passage], ...]
    free_m2: float
    cut_off: bool
    containers: int
    unreachable: tuple[ContainerId, ...]
    access: Result[RoomAccess]


def rooms_reached(plan: FloorPlan, navigation: Navigation) -> tuple[RoomReach, ...]:
    """The reach of every room, in the plan's order.

    Args:
        navigation: of this plan, for a robot of ROBOT_RADIUS_M.
    """
    labels = room_labels(plan, navigation.grid)
    clear = clear_cells(navigation.grid, ROBOT_RADIUS_M)
    lost = set(navigation.travel.unreachable)
    around = _passages(plan)
    reached: list[RoomReach] = []
    for index, room in enumerate(plan.rooms):
        cells = int(np.count_nonzero(navigation.free & (labels == index)))
        cut_off = _is_cut_off(cells, int(np.count_nonzero(clear & (labels == index))))
        containers = [container.id for container in plan.containers if container.room == room.id]
        away = tuple(container for container in containers if container in lost)
        access = RoomAccess.WHOLE.result()
        if cut_off:
            access = _access_cut_off(plan, index, ROBOT_RADIUS_M)
        elif away:
            access = RoomAccess.NO_FREE_FLOOR.result(reach_m=f"{REACH_M:g}", radius_m=f"{ROBOT_RADIUS_M:g}")
        reached.append(
            RoomReach(
                room=room.id,
                kind=room.kind,
                joined=tuple(sorted(around[room.id])),
                free_m2=round(cells * navigation.grid.resolution_m**2, 2),
                cut_off=cut_off,
                containers=len(containers),
                unreachable=away,
                access=access,
            )
        )
    return tuple(reached)


def _passages(plan: FloorPlan) -> dict[RoomId, set[tuple[RoomId, Passage]]]:
    """For each room, the rooms that doors between two rooms and open walls lead to."""
    found: dict[RoomId, set[tuple[RoomId, Passage]]] = {room.id: set() for room in plan.rooms}

    def join(rooms: tuple[RoomId, ...], by: Passage) -> None:
        for room in rooms:
            found[room].update((other, by) for other in rooms if other != room)

    for door in plan.doors:
        if door.passable:
            join(door.rooms, "door")
    for wall in plan.walls:
        if wall.empty:
            join(rooms_beside(wall, plan.rooms), "open wall")
    return found


def _access_cut_off(plan: FloorPlan, room: int, robot_radius_m: float) -> Result[RoomAccess]:
    """Whether a finer grid or a thinner robot would enter a room: the grid, the width or the house cuts it off."""
    for radius_m, access in (
        (robot_radius_m, RoomAccess.GRID_TOO_COARSE.result(cell_m=f"{FINER_M:g}")),
        (0.0, RoomAccess.TOO_NARROW.result(width_m=f"{2 * robot_radius_m:g}")),
    ):
        grid = occupancy_of(plan, resolution_m=FINER_M)
        inside = room_labels(plan, grid) == room
        cells, clear = (int(np.count_nonzero(of(grid, radius_m) & inside)) for of in (free_cells, clear_cells))
        if not _is_cut_off(cells, clear):
            return access
    return RoomAccess.NO_WAY_IN.result()


def _is_cut_off(cells: int, clear: int) -> bool:
    """Whether the reached cells of a room are too few of its clear ones."""
    return cells == 0 or cells < CUT_OFF_SHARE * clear
