"""The planned path of the robot: the rest of the current leg, then leg after leg of the plan.

The log holds the path of a leg that was walked; other legs are computed on the place's grid, once each.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, final

import numpy as np

from workbench.arrays import Floats
from workbench.caches import Cache
from workbench.log_schema.place import Place
from workbench.worlds.geometry import Point
from workbench.worlds.house import LocationId

if TYPE_CHECKING:
    from workbench.log_schema.events import ActionFinished, PlanComputed, Step

MAX_CACHED_PATHS = 2_000
MAX_LEGS = 12
"""The most legs of a plan that are drawn; a longer plan is clearer without its far end."""


@final
class PlannedPaths:
    """Computes and caches planned paths in a place."""

    def __init__(self, place: Place) -> None:
        self._paths = place.paths()
        self._found: Cache[tuple[str, ...], Floats] = Cache(MAX_CACHED_PATHS)

    def through(self, stops: tuple[str, ...]) -> Floats:
        """Corners of the path through locations in order, float64 (k, 2); empty for fewer than two."""
        return self._found.get(stops, lambda: self._corners(stops))

    def _corners(self, stops: tuple[str, ...]) -> Floats:
        corners: list[Point] = []
        for a, b in itertools.pairwise(stops):
            leg = self._paths.path(LocationId(a), LocationId(b))
            corners += list(leg or ())
        return np.array(corners, dtype=np.float64).reshape(-1, 2)


def rest_of_leg(action: ActionFinished, stamp_ns: int) -> Floats:
    """The rest of the path of an action at a moment, without the robot's own position; float64 (k, 2)."""
    path = np.array(action.path, dtype=np.float64).reshape(-1, 2)
    if len(path) < 2 or action.stamp.ns <= stamp_ns:
        return np.zeros((0, 2))
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    span = action.stamp.ns - action.start.ns
    gone = length[-1] * max(0.0, (stamp_ns - action.start.ns) / span) if span > 0 else 0.0
    return path[length > gone]


def stops_after(plan: PlanComputed, first_step: int, standing: str) -> tuple[str, ...]:
    """The locations that a plan visits from a step on, starting from where the robot then stands.

    A find goes to the first container of the intended order, then to where it brings the item.
    """
    stops = [standing]
    for step in plan.steps[first_step:]:
        for stop in _stops_of(step, plan, is_first_find=step is _first_find(plan)):
            if stop != stops[-1]:
                stops.append(stop)
    return tuple(stops[: MAX_LEGS + 1])


def _stops_of(step: Step, plan: PlanComputed, *, is_first_find: bool) -> tuple[str, ...]:
    if step.action == "find" and is_first_find and plan.search_order:
        return (plan.search_order[0].container, step.target)
    return (step.target,)


def _first_find(plan: PlanComputed) -> Step | None:
    return next((step for step in plan.steps if step.action == "find"), None)
