"""The robot's path from the paths of its actions, for simulations and replays, whose actions hold them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from math import atan2, hypot

import numpy as np

from workbench.arrays import Bools, Floats
from workbench.log_schema.events import NANO, ActionFinished
from workbench.log_schema.place import Place
from workbench.worlds.geometry import Point
from workbench.worlds.house import START, LocationId


def path_of_actions(
    place: Place, actions: Sequence[ActionFinished], start_ns: int
) -> tuple[Floats, Floats, Floats, Bools]:
    """Corners of the walked path, each with its time in seconds, the heading from there on, and whether it was
    assumed."""
    at = _first_place(place, actions)
    seconds: list[float] = [0.0]
    corners: list[Point] = [at]
    facing: list[float] = [place.plan.start.yaw_rad]
    imputed: list[bool] = [False]
    for action in actions:
        path = [(float(x), float(y)) for x, y in action.path]
        began, ended = (action.start.ns - start_ns) / NANO, (action.stamp.ns - start_ns) / NANO
        if len(path) >= 2:
            lengths = [hypot(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(path)]
            total, gone = sum(lengths) or 1.0, 0.0
            for i, point in enumerate(path):
                heading = _heading(path[i], path[i + 1]) if i + 1 < len(path) else facing[-1]
                seconds.append(began + (ended - began) * gone / total)
                corners.append(point)
                facing.append(heading)
                imputed.append(action.support == "imputed")
                gone += lengths[i] if i < len(lengths) else 0.0
        standing = place.standing.get(LocationId(action.target))
        if standing is not None and action.success:
            seconds.append(max(ended, seconds[-1]))
            corners.append(standing.point if len(path) < 2 and action.action == "move" else corners[-1])
            facing.append(standing.yaw_rad)
            imputed.append(False)
    corner_array = np.array(corners, dtype=np.float64)
    return np.maximum.accumulate(np.array(seconds)), corner_array, np.array(facing), np.array(imputed)


def _first_place(place: Place, actions: Sequence[ActionFinished]) -> Point:
    for action in actions:
        if action.path:
            return (float(action.path[0][0]), float(action.path[0][1]))
    standing = place.standing.get(START)
    return standing.point if standing is not None else place.plan.start.point


def _heading(a: Point, b: Point) -> float:
    return atan2(b[1] - a[1], b[0] - a[0])
