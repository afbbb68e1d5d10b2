"""The sight of a run in passing: how far the robot sees from where it is, and what it has seen so by a moment."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.arrays import Floats
from workbench.caches import PerObject
from workbench.errors import LiosError
from workbench.log_schema.sight_json import sight_from_settings
from workbench.worlds.geometry import Point
from workbench.worlds.house import ContainerId
from workbench.worlds.sight.field_of_view import FieldOfView

if TYPE_CHECKING:
    from dashboards.model.timeline import Timeline


@dataclass(frozen=True, slots=True, kw_only=True)
class PassingSight:
    """One container that was seen in passing.

    Attributes:
        viewpoint: where the robot was, in metres on the map.
        container: the container that it saw, as an index into the plan's containers.
    """

    stamp_ns: int
    viewpoint: Point
    container: int


_FIELD: PerObject[int, FieldOfView | None] = PerObject(2)
_PASSED: PerObject[int, tuple[PassingSight, ...]] = PerObject(2)
_OUTLINES: PerObject[Point, Floats] = PerObject(256)


def field_of(timeline: Timeline) -> FieldOfView | None:
    """The field of view of a run's robot; None for one that sees nothing in passing."""
    return _FIELD.of(timeline).get(0, lambda: _field(timeline))


def sight_outline(timeline: Timeline, point: Point) -> Floats | None:
    """The outline of what the robot sees from a point, float64 (n, 2); None where it sees nothing in passing."""
    field = field_of(timeline)
    return None if field is None else _OUTLINES.of(timeline).get(point, lambda: field.outline(point))


def seen_in_passing(timeline: Timeline, stamp_ns: int) -> tuple[PassingSight, ...]:
    """What the robot has seen in passing by a moment, in order; only where the log says from which point."""
    passed = _PASSED.of(timeline).get(0, lambda: _passed(timeline))
    return passed[: bisect_right(passed, stamp_ns, key=lambda sight: sight.stamp_ns)]


def _field(timeline: Timeline) -> FieldOfView | None:
    plan = timeline.plan
    try:
        radius_m = sight_from_settings(timeline.run.settings)
    except LiosError:  # a damaged log: the rest of it can be shown
        return None
    return FieldOfView(plan, radius_m) if radius_m and plan.rooms else None


def _passed(timeline: Timeline) -> tuple[PassingSight, ...]:
    index: dict[ContainerId, int] = {c.id: i for i, c in enumerate(timeline.plan.containers)}
    passed = [
        PassingSight(
            stamp_ns=timeline.start_ns if seen.known_at_start else seen.stamp.ns,
            viewpoint=(seen.passing.viewpoint[0], seen.passing.viewpoint[1]),
            container=index[ContainerId(seen.container)],
        )
        for seen in timeline.run.observations
        if seen.passing is not None
        and ContainerId(seen.container) in index
        and len(seen.passing.viewpoint) > 1
        and np.isfinite(seen.passing.viewpoint).all()
    ]
    return tuple(sorted(passed, key=lambda sight: sight.stamp_ns))
