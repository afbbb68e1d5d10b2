"""The assignment of items to containers: one for each item, however near others stand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import cos, hypot, sin
from statistics import median
from typing import final

from workbench.worlds.house import Container, ContainerId, FloorPlan, ItemId

Position = tuple[float, float, float]
MARGIN_M = 0.35
"""How far beside a container an item's tag may be seen."""
REACH_UP_M = 0.8
"""A tag up to this many metres above a container's top is on it."""


def within(container: Container, position: Position, *, margin_m: float) -> bool:
    """Whether a position is in or on a container, or at most margin_m beside it."""
    top = container.base_m + container.size_m[2] + REACH_UP_M
    return position[2] <= top and _outside(container, position) <= margin_m


def container_at(plan: FloorPlan, position: Position, *, margin_m: float) -> ContainerId | None:
    """The one container that a position is in, on, or at most margin_m beside; None if there is none.

    Of several it is the nearest, and of several that it is in, the one whose middle is nearest.
    """
    near = [
        (_outside(c, position), hypot(position[0] - c.pose.x_m, position[1] - c.pose.y_m), c.id)
        for c in plan.containers
        if within(c, position, margin_m=margin_m)
    ]
    return min(near)[2] if near else None


@final
class ItemPlaces:
    """The container in which each item was seen first; until it is moved, no look into another one shows it.

    Args:
        margin_m: how far beside a container an item may be seen.
    """

    def __init__(self, plan: FloorPlan, *, margin_m: float) -> None:
        self._plan, self._margin_m = plan, margin_m
        self._at: dict[ItemId, ContainerId] = {}

    def shown_in(self, container: ContainerId, seen: Mapping[ItemId, Sequence[Position]]) -> tuple[ItemId, ...]:
        """The items that a look into a container shows, sorted.

        Args:
            seen: every position at which an item was seen during the look; the median counts.
        """
        return tuple(item for item in sorted(seen) if self._is_in(container, item, seen[item]))

    def settle(self, container: ContainerId, items: Iterable[ItemId]) -> None:
        """A look has shown these items in a container."""
        for item in items:
            self._at.setdefault(item, container)

    def moved(self, item: ItemId) -> None:
        """An item was picked up: it may be anywhere afterwards."""
        self._at.pop(item, None)

    def _is_in(self, container: ContainerId, item: ItemId, positions: Sequence[Position]) -> bool:
        if not positions or self._at.get(item, container) != container:
            return False
        x, y, z = (median(axis) for axis in zip(*positions, strict=True))
        return container_at(self._plan, (x, y, z), margin_m=self._margin_m) == container


def _outside(container: Container, position: Position) -> float:
    """How far outside the footprint a position is; 0 inside."""
    dx, dy = position[0] - container.pose.x_m, position[1] - container.pose.y_m
    c, s = cos(container.pose.yaw_rad), sin(container.pose.yaw_rad)
    along = abs(c * dx + s * dy) - container.size_m[0] / 2
    across = abs(-s * dx + c * dy) - container.size_m[1] / 2
    return hypot(max(0.0, along), max(0.0, across))
