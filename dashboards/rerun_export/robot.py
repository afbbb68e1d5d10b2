"""The robot of a run and the path that it walked."""

from __future__ import annotations

import numpy as np
import rerun as rr

from dashboards.geometry.marks import ROBOT_DARK, Mesh, robot_body, robot_legs
from dashboards.model.timeline import Timeline
from dashboards.palette import Colour, run_colour
from dashboards.rerun_export.times import time_columns
from workbench.arrays import Floats
from workbench.log_schema.events import NANO

POSES_PER_S = 5.0
"""Poses between the corners of the path, so that the robot glides: Rerun does not interpolate."""
MAX_POSES = 20_000
PATH_UP_M, PATH_RADIUS_M = 0.06, 0.025


def log_robot(recording: rr.RecordingStream, timeline: Timeline) -> None:
    """Write the robot's body, its pose over time, and its path, one piece for each stretch that it walked.

    A piece appears when its stretch is walked to the end, and stays.
    """
    colour = run_colour(0)
    for part, mesh, paint in (("body", robot_body(), colour), ("legs", robot_legs(), ROBOT_DARK)):
        recording.log(f"robot/{part}", _mesh(mesh, paint), static=True)
    seconds = _pose_seconds(timeline)
    xy = _positions(timeline, seconds)
    corner = np.clip(np.searchsorted(timeline.path_s, seconds, side="right") - 1, 0, None)
    half = timeline.heading_rad[corner] / 2
    zero = np.zeros(len(seconds))
    recording.send_columns(
        "robot",
        time_columns(timeline, [timeline.stamp(second) for second in seconds]),
        rr.Transform3D.columns(
            translation=np.column_stack([xy, zero]),
            quaternion=np.column_stack([zero, zero, np.sin(half), np.cos(half)]),
        ),
    )
    for number, (end_ns, points) in enumerate(path_pieces(timeline), start=1):
        strip = np.column_stack([points, np.full(len(points), PATH_UP_M)])
        recording.send_columns(
            f"way/{number:04}",
            time_columns(timeline, [end_ns]),
            rr.LineStrips3D.columns(strips=[strip], colors=[colour], radii=[PATH_RADIUS_M]),
        )


def path_pieces(timeline: Timeline) -> list[tuple[int, Floats]]:
    """The way in pieces that end where an action ends or a decision falls, without those of no length.

    Returns:
        For each piece the stamp of its end, and its corners, float64 (m, 2).
    """
    ends = {*timeline.decision_ns, *(action.stamp.ns for action in timeline.actions), timeline.end_ns}
    pieces: list[tuple[int, Floats]] = []
    before_s = -np.inf
    for end_ns in sorted(ends):
        second = timeline.seconds(end_ns)
        inside = timeline.path_xy[(timeline.path_s > before_s) & (timeline.path_s < second)]
        first = _positions(timeline, np.array([max(before_s, float(timeline.path_s[0]))]))
        points = np.concatenate([first, inside, _positions(timeline, np.array([second]))])
        moved = np.concatenate([[True], np.any(np.diff(points, axis=0) != 0, axis=1)])
        if moved.sum() > 1:
            pieces.append((end_ns, points[moved]))
        before_s = second
    return pieces


def _pose_seconds(timeline: Timeline) -> Floats:
    """The moments at which a pose is written: the corners of the path, and a grid between them."""
    steps = min(MAX_POSES, int(timeline.duration_s * POSES_PER_S) + 1)
    grid = np.linspace(0.0, timeline.duration_s, steps)
    moments = np.unique(np.concatenate([timeline.path_s, grid]))
    return np.round(moments[moments >= 0] * NANO) / NANO


def _positions(timeline: Timeline, seconds: Floats) -> Floats:
    x, y = timeline.path_xy.T
    return np.column_stack([np.interp(seconds, timeline.path_s, x), np.interp(seconds, timeline.path_s, y)])


def _mesh(mesh: Mesh, colour: Colour) -> rr.Mesh3D:
    vertices, faces = mesh
    colours = np.tile(np.array(colour, dtype=np.uint8), (len(vertices), 1))
    return rr.Mesh3D(vertex_positions=vertices, triangle_indices=faces, vertex_colors=colours)
