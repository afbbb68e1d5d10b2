"""The container that a ray from the camera meets first."""

from __future__ import annotations

from math import cos, inf, sin

from workbench.tolerances import DEGENERATE
from workbench.worlds.house import Container, FloorPlan

Vector = tuple[float, float, float]
MARGIN_M = 0.05
"""How far beside a container a ray may pass and still meet it; flat and thin furniture is hard to hit."""
ABOVE_M = 0.25
"""How far above its top: what is drawn on a container belongs to it."""


def container_met(plan: FloorPlan, origin: Vector, direction: Vector) -> int | None:
    """The index of the container whose box (turned as the container is) the ray enters first; None for none.

    Args:
        origin: in metres on the map; direction: of any length but 0.
    """
    entered = [(_distance(container, origin, direction), i) for i, container in enumerate(plan.containers)]
    nearest, index = min(entered, default=(inf, 0))
    return index if nearest < inf else None


def _distance(container: Container, origin: Vector, direction: Vector) -> float:
    """Where the ray enters the box, in lengths of its direction; inf where it misses. By slabs (Kay and Kajiya,
    1986)."""
    pose, (wide, deep, high) = container.pose, container.size_m
    c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
    x, y = origin[0] - pose.x_m, origin[1] - pose.y_m
    start = (c * x + s * y, -s * x + c * y, origin[2])
    ahead = (c * direction[0] + s * direction[1], -s * direction[0] + c * direction[1], direction[2])
    low = (-wide / 2 - MARGIN_M, -deep / 2 - MARGIN_M, container.base_m)
    top = (wide / 2 + MARGIN_M, deep / 2 + MARGIN_M, container.base_m + high + ABOVE_M)
    enters, leaves = 0.0, inf
    for axis in range(3):
        if abs(ahead[axis]) < DEGENERATE:
            if not low[axis] <= start[axis] <= top[axis]:
                return inf
            continue
        one, other = (low[axis] - start[axis]) / ahead[axis], (top[axis] - start[axis]) / ahead[axis]
        enters, leaves = max(enters, min(one, other)), min(leaves, max(one, other))
    return enters if enters <= leaves else inf
