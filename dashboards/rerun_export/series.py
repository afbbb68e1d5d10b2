"""The numbers of a run over time: cost so far, plan costs, find costs and beliefs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from dashboards.model.timeline import Timeline
from dashboards.rerun_export.times import time_columns

Series = list[tuple[int, float]]
"""(stamp in nanoseconds since the epoch, value), in order."""


def log_series(recording: rr.RecordingStream, timeline: Timeline) -> None:
    """Write every series of a run under its entity path; costs are in the unit of the log."""
    for path, points in series_of(timeline).items():
        recording.send_columns(
            path,
            time_columns(timeline, [stamp for stamp, _ in points]),
            rr.Scalars.columns(scalars=np.array([value for _, value in points], dtype=np.float64)),
        )


def series_of(timeline: Timeline) -> dict[str, Series]:
    """The series of a run by their entity paths; values that are not finite are left out.

    cost/so_far: charged for actions until then. cost/plan: expected cost of each plan from its decision on.
    find_costs/ITEM/TARGET: expected cost, at a decision, of finding the item from where the robot stands and
    carrying it to the target. belief/ITEM/CONTAINER: probability that the item is in the container.
    """
    made: dict[str, Series] = {
        "cost/so_far": [
            (timeline.stamp(float(second)), float(cost))
            for second, cost in zip(timeline.cost_s, timeline.cost, strict=True)
        ],
        "cost/plan": [
            (frame.stamp_ns, frame.plan.expected_cost)
            for frame in timeline.decisions
            if frame.plan is not None and frame.plan.expected_cost is not None
        ],
    }
    for frame in timeline.decisions:
        costs = frame.find_costs
        if costs is not None and frame.plan is not None and frame.plan.robot_at in costs.origins:
            here = costs.origins.index(frame.plan.robot_at)
            rows = [by_origin[here] for by_origin in costs.metres]
            _add(made, "find_costs", frame.stamp_ns, (costs.item_types, costs.targets), rows)
        if frame.belief is not None:
            labels = (frame.belief.item_types, frame.belief.containers)
            _add(made, "belief", frame.stamp_ns, labels, frame.belief.probability)
    finite = {path: [point for point in points if np.isfinite(point[1])] for path, points in made.items()}
    return {path: points for path, points in finite.items() if points}


def _add(
    made: dict[str, Series],
    root: str,
    stamp_ns: int,
    labels: tuple[Sequence[str], Sequence[str]],
    rows: Sequence[Sequence[float]],
) -> None:
    """Add one value to the series of every item type and place."""
    for item_type, row in zip(labels[0], rows, strict=True):
        for place, value in zip(labels[1], row, strict=True):
            path = rr.new_entity_path([root, item_type, place]).removeprefix("/")
            made.setdefault(path, []).append((stamp_ns, value))
