"""Meshes and line segments of marks: the robot, ticks and crosses over containers, question marks, dashed paths."""

from __future__ import annotations

import numpy as np

from dashboards.geometry.solids import unit_mesh
from dashboards.palette import Colour
from workbench.arrays import Bools, Floats, Floats32, Ints, Uints32
from workbench.tolerances import MIN_LENGTH_M
from workbench.worlds.geometry import Pose

Mesh = tuple[Floats32, Uints32]
"""Vertices (V, 3) and faces (F, 3)."""

ROBOT_DARK: Colour = (52, 54, 60)
FRAME_M = 0.07
"""Width of the frame around a place of the goal."""
MAX_DASHES = 20_000
MIN_DASH_M = 1e-3
SAME_M = 1e-3
"""Ends of segments as close as this count as one place."""
MAX_SEGMENT_M = 1e7
"""A longer segment is not a path within a place but a damaged number."""


def robot_body() -> Mesh:
    """Trunk, shoulders and arm of a small four-legged robot of Spot's size; faces +x, stands on z = 0."""
    return merged(
        box((0.0, 0.0, 0.42), (0.78, 0.24, 0.17)),
        box((0.40, 0.0, 0.43), (0.12, 0.20, 0.15)),
        box((0.24, 0.0, 0.53), (0.16, 0.10, 0.08)),
        box((0.36, 0.0, 0.62), (0.34, 0.06, 0.06), pitch_rad=-0.35),
        box((0.53, 0.0, 0.69), (0.14, 0.10, 0.09)),
    )


def robot_legs() -> Mesh:
    """Its legs and face."""
    legs = []
    for x in (0.28, -0.28):
        for y in (0.15, -0.15):
            legs.append(box((x - 0.04, y, 0.28), (0.09, 0.07, 0.26), pitch_rad=0.35))
            legs.append(box((x - 0.05, y, 0.10), (0.05, 0.05, 0.24), pitch_rad=-0.35))
    return merged(*legs, box((0.465, 0.0, 0.43), (0.02, 0.14, 0.09)))


def robot_ghost() -> Mesh:
    """The same robot in a few faces, for runs that are drawn pale: trunk, arm, and legs without their ends."""
    legs = [box((x - 0.04, y, 0.2), (0.08, 0.06, 0.42)) for x in (0.28, -0.28) for y in (0.15, -0.15)]
    open_legs = [(vertices, faces[:-4]) for vertices, faces in legs]  # the last four faces are its ends
    trunk = box((0.03, 0.0, 0.42), (0.86, 0.24, 0.17))
    return merged(trunk, box((0.40, 0.0, 0.63), (0.42, 0.09, 0.09), pitch_rad=-0.35), *open_legs)


def cross() -> Mesh:
    """An x lying flat, 0.22 m wide: searched, and the item was not there."""
    return merged(
        box((0, 0, 0), (0.24, 0.06, 0.03), yaw_rad=np.pi / 4), box((0, 0, 0), (0.24, 0.06, 0.03), yaw_rad=-np.pi / 4)
    )


def tick() -> Mesh:
    """A tick lying flat, 0.4 m wide: searched, and the item was there."""
    return merged(
        box((-0.09, -0.02, 0), (0.20, 0.08, 0.04), yaw_rad=-np.pi / 4),
        box((0.09, 0.05, 0), (0.38, 0.08, 0.04), yaw_rad=np.pi / 4),
    )


def unseen_marker() -> Mesh:
    """A diamond standing on its tip: nobody looked here, and a replay would have had to."""
    vertices, faces = unit_mesh("ball")
    corners = vertices[faces.reshape(-1)] * np.array([0.2, 0.2, 0.34], dtype=np.float32)
    return corners.astype(np.float32), np.arange(faces.size, dtype=np.uint32).reshape(-1, 3)  # facets, not a ball


def goal_frame(pose: Pose, size_m: tuple[float, float], height_m: float) -> Mesh:
    """A frame around a footprint at a height: a place that the goal names."""
    wide, deep = size_m[0] + FRAME_M, size_m[1] + FRAME_M
    sides = merged(
        box((0, deep / 2, 0), (wide + FRAME_M, FRAME_M, FRAME_M)),
        box((0, -deep / 2, 0), (wide + FRAME_M, FRAME_M, FRAME_M)),
        box((wide / 2, 0, 0), (FRAME_M, deep, FRAME_M)),
        box((-wide / 2, 0, 0), (FRAME_M, deep, FRAME_M)),
    )
    c, s = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    placed = sides[0] @ turn.T + np.array([pose.x_m, pose.y_m, height_m])
    return placed.astype(np.float32), sides[1]


def unopened_marker() -> Mesh:
    """A question mark lying flat, 0.2 m high: nobody ever looked in."""
    return merged(
        box((-0.045, 0.045, 0), (0.03, 0.05, 0.02)),
        box((0.0, 0.085, 0), (0.12, 0.03, 0.02)),
        box((0.045, 0.045, 0), (0.03, 0.07, 0.02)),
        box((0.022, 0.005, 0), (0.075, 0.03, 0.02)),
        box((0.0, -0.03, 0), (0.03, 0.06, 0.02)),
        box((0.0, -0.095, 0), (0.034, 0.034, 0.02)),
    )


def box(
    centre: tuple[float, float, float],
    size_m: tuple[float, float, float],
    *,
    yaw_rad: float = 0.0,
    pitch_rad: float = 0.0,
) -> Mesh:
    """A box around its centre, pitched about y and then turned about z."""
    vertices, faces = unit_mesh("box")
    c, s = np.cos(pitch_rad), np.sin(pitch_rad)
    pitch = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    yaw = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    placed = (vertices * np.array(size_m)) @ (yaw @ pitch).T + np.array(centre)
    return placed.astype(np.float32), faces


def merged(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    offset = np.cumsum([0, *[len(v) for v, _ in meshes[:-1]]])
    vertices = np.concatenate([v for v, _ in meshes])
    faces = np.concatenate([f + o for (_, f), o in zip(meshes, offset, strict=True)])
    return vertices.astype(np.float32), faces.astype(np.uint32)


def segments(path: Floats, height_m: float) -> Floats32:
    """A path's corners (m, 2) as line segments at a height, float32 (m - 1, 2, 3)."""
    if len(path) < 2:
        return np.zeros((0, 2, 3), dtype=np.float32)
    lengths = np.hypot(*(path[1:] - path[:-1]).T)
    return _pairs(path, height_m)[lengths > MIN_LENGTH_M].astype(np.float32)


def path_segments(path: Floats, imputed: Bools, height_m: float) -> Floats32:
    """A path as line segments, dashed where it was only assumed; float32 (n, 2, 3)."""
    if not imputed.any():
        return segments(path, height_m)
    parts: list[Floats32] = []
    changes = np.flatnonzero(np.diff(imputed[1:].astype(np.int8))) + 1
    for first, last in zip([0, *changes], [*changes, len(path) - 1], strict=True):
        stretch = path[first : last + 1]
        parts.append(dashes(stretch, height_m) if imputed[last] else segments(stretch, height_m))
    return np.concatenate(parts) if parts else segments(path, height_m)


def dashes(path: Floats, height_m: float) -> Floats32:
    """A path as dashes, float32 (n, 2, 3)."""
    return dashed(_pairs(path, height_m))[0]


def dashed(lines: Floats | Floats32, *, dash_m: float = 0.22, gap_m: float = 0.16) -> tuple[Floats32, Ints]:
    """Level line segments (m, 2, 3) as dashes (n, 2, 3), and which segment each dash is of, (n,).

    The phase of the dashes depends on the line that they lie on, not on where the path began: there and back along
    one line they coincide, where each row would otherwise fill the other's gaps. On paths that would take more than
    MAX_DASHES they are longer.
    """
    ends = np.asarray(lines, dtype=np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.hypot(*(ends[:, 1, :2] - ends[:, 0, :2]).T)
    kept = np.flatnonzero((lengths > MIN_LENGTH_M) & (lengths < MAX_SEGMENT_M))
    start, stop, length = ends[kept, 0, :2], ends[kept, 1, :2], lengths[kept]
    along = (stop - start) / length[:, None]
    rounded = np.round(along, 6)
    along[(rounded[:, 0] < 0) | ((rounded[:, 0] == 0) & (rounded[:, 1] < 0))] *= -1
    stretch = max(1.0, float(length.sum()) / (dash_m + gap_m) / MAX_DASHES)
    dash, period = dash_m * stretch, (dash_m + gap_m) * stretch
    reach = np.stack([_dot(start, along), _dot(stop, along)])
    low, high = reach.min(axis=0), reach.max(axis=0)
    first = np.floor(low / period)
    count = (np.floor(high / period) - first).astype(np.int64) + 1
    line = np.repeat(np.arange(len(length)), count)
    turn = first[line] + np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
    begins = np.clip(turn * period, low[line], high[line])
    stops = np.clip(turn * period + dash, low[line], high[line])
    seen = stops - begins > MIN_DASH_M
    line, foot = line[seen], start - _dot(start, along)[:, None] * along
    points = [foot[line] + at[:, None] * along[line] for at in (begins[seen], stops[seen])]
    return np.concatenate([np.stack(points, axis=1), ends[kept[line], :, 2:]], axis=2).astype(np.float32), kept[line]


def uncovered(lines: Floats32) -> Ints:
    """Which segments (n, 2, 3) have the same two ends on the map as none before them, in order."""
    ends = np.round(lines[:, :, :2] / SAME_M).astype(np.int64)
    turned = (ends[:, 0, 0] > ends[:, 1, 0]) | ((ends[:, 0, 0] == ends[:, 1, 0]) & (ends[:, 0, 1] > ends[:, 1, 1]))
    ends[turned] = ends[turned, ::-1]
    _, first = np.unique(ends.reshape(len(ends), 4), axis=0, return_index=True)
    return np.sort(first)


def _pairs(path: Floats, height_m: float) -> Floats:
    points = np.column_stack([path, np.full(len(path), height_m)])
    return np.stack([points[:-1], points[1:]], axis=1)


def _dot(a: Floats, b: Floats) -> Floats:
    return (a * b).sum(axis=1)
