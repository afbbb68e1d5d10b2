"""The path of a real robot from the poses of its log, without the jitter of standing still.

The actions of a robot's log give only the ends of its paths; that it waited, turned and slowed down in between is in
its poses alone.
"""

from __future__ import annotations

from math import atan2, hypot
from typing import TYPE_CHECKING

import numpy as np

from workbench.arrays import Floats
from workbench.log_schema.events import NANO

if TYPE_CHECKING:
    from replayers.runs.run import Run

MADE_OF_ACTIONS = ("simulation", "replay")
"""Sources whose actions hold exact paths; every other source is a robot."""
MAP = "map"
MIN_STEP_M, MIN_TURN_RAD = 0.04, 0.15
"""A pose closer to the previous one, and turned by less, counts as standing still."""

TimedPath = tuple[Floats, Floats, Floats]
"""Seconds (n,), corners (n, 2), headings (n,)."""


def path_of_poses(run: Run, start_ns: int, end_ns: int) -> TimedPath | None:
    """The robot's path on the map within the run; None for a run that is not a robot's, or without two poses."""
    if run.info.source in MADE_OF_ACTIONS or len(run.raw_poses) < 2:
        return None
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
    from google.protobuf.message import DecodeError

    rows: list[tuple[float, float, float, float]] = []
    for log_time, data in run.raw_poses:
        try:
            message = PoseInFrame.FromString(data)
        except DecodeError:
            continue
        at, q = message.pose.position, message.pose.orientation
        stamp = message.timestamp.seconds * NANO + message.timestamp.nanos or log_time
        yaw = atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        row = ((stamp - start_ns) / NANO, at.x, at.y, yaw)
        if message.frame_id == MAP and np.isfinite(row).all() and (not rows or _moved(rows[-1], row)):
            if rows and row[0] - rows[-1][0] > 0:
                rows += _standing_corner(rows[-1], row)
            rows.append(row)
    last_s = (end_ns - start_ns) / NANO
    within = [row for row in sorted(rows) if 0.0 <= row[0] <= last_s]
    if len(within) < 2:
        return None
    table = np.array([(0.0, *within[0][1:]), *within], dtype=np.float64)
    return table[:, 0], table[:, 1:3], table[:, 3]


def _moved(before: tuple[float, float, float, float], row: tuple[float, float, float, float]) -> bool:
    turned = abs(atan2(np.sin(row[3] - before[3]), np.cos(row[3] - before[3])))
    return hypot(row[1] - before[1], row[2] - before[2]) >= MIN_STEP_M or turned >= MIN_TURN_RAD


def _standing_corner(
    before: tuple[float, float, float, float], row: tuple[float, float, float, float]
) -> list[tuple[float, float, float, float]]:
    """If it stood for a while before this pose, one more corner at the end of that: it did not creep from there to
    here."""
    return [(row[0] - PAUSE_S, *before[1:])] if row[0] - before[0] > 2 * PAUSE_S else []


PAUSE_S = 0.5
"""Poses further apart than twice this are a pause between two walks."""
