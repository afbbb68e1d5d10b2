"""What the offline page draws of a run's sight: the walls that cut the view off, and what was seen in passing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dashboards.geometry.occupancy import occupied_stretches
from dashboards.geometry.sight_marks import EYE_UP_M, FIELD_UP_M, dots_between
from dashboards.model.perception.sight import field_of, seen_in_passing
from dashboards.model.timeline import Timeline
from workbench.worlds.sight.field_of_view import RAYS


def sight_data(timeline: Timeline, tops_m: Sequence[tuple[float, float, float]]) -> dict[str, Any]:
    """The sight of one run for the page.

    Args:
        tops_m: for each container of the plan, the point over it.
    """
    return {"sight": _field(timeline), "passed": _passed(timeline, tops_m)}


def _field(timeline: Timeline) -> dict[str, Any] | None:
    field = field_of(timeline)
    if field is None:
        return None
    grid = field.walls
    rows, columns = grid.occupied.shape
    return {
        "radius": field.radius_m,
        "rays": RAYS,
        "steps": field.steps,
        "up": FIELD_UP_M,
        "origin": [round(v, 6) for v in grid.origin],
        "cell": grid.resolution_m,
        "rows": rows,
        "columns": columns,
        "occupied": occupied_stretches(grid.occupied).astype(np.int64).ravel().tolist(),
    }


def _passed(timeline: Timeline, tops_m: Sequence[tuple[float, float, float]]) -> list[list[Any]]:
    """[second, the dots to what was seen, the eye], in order."""
    made: list[list[Any]] = []
    for sight in seen_in_passing(timeline, timeline.end_ns):
        eye = np.array((*sight.viewpoint, EYE_UP_M))
        dots = dots_between(eye, np.array(tops_m[sight.container]))
        made.append(
            [
                round(timeline.seconds(sight.stamp_ns), 6),
                np.round(dots.astype(np.float64), 3).ravel().tolist(),
                np.round(eye, 3).tolist(),
            ]
        )
    return made
