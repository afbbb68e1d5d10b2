"""The house of a run as static entities: floors, room names, walls, furniture without containers."""

from __future__ import annotations

import numpy as np
import rerun as rr

from dashboards.geometry.floors import floors
from dashboards.geometry.furniture import solids_of
from dashboards.geometry.solids import NO_OWNER, Batch, batches, unit_mesh
from dashboards.geometry.walls import CUT_AWAY_M, wall_solids
from workbench.arrays import Floats32
from workbench.worlds.house import FloorPlan

LABEL_UP_M = 0.05


def log_house(recording: rr.RecordingStream, plan: FloorPlan) -> None:
    """Write what of a floor plan does not change during a run; z is up, metres in the map frame."""
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    rooms = floors(plan)
    for floor in rooms:
        mesh = rr.Mesh3D(
            vertex_positions=floor.vertices,
            triangle_indices=floor.faces,
            vertex_colors=np.tile(np.array(floor.colour, dtype=np.uint8), (len(floor.vertices), 1)),
        )
        recording.log(rr.new_entity_path(["house", "floors", floor.room]), mesh, static=True)
    if rooms:
        names = rr.Points3D(
            [(*floor.label_at, LABEL_UP_M) for floor in rooms],
            radii=0.01,
            colors=[(90, 94, 102)],
            labels=[floor.kind for floor in rooms],
            show_labels=True,
        )
        recording.log("house/rooms", names, static=True)
    standing = [piece for piece in plan.furniture if piece.base_m < CUT_AWAY_M]
    _log_solids(recording, "house/walls", batches(wall_solids(plan)))
    _log_solids(
        recording, "house/furniture", batches(s for piece in standing for s in solids_of(piece, owner=NO_OWNER))
    )


def _log_solids(recording: rr.RecordingStream, path: str, of_shapes: tuple[Batch, ...]) -> None:
    """One entity for each shape: boxes as boxes, round solids as one mesh."""
    for batch in of_shapes:
        if batch.shape == "box":
            recording.log(
                f"{path}/box",
                rr.Boxes3D(
                    centers=batch.centre,
                    half_sizes=batch.size_m / 2,
                    quaternions=batch.wxyz()[:, [1, 2, 3, 0]],
                    colors=batch.colour,
                    fill_mode="solid",
                ),
                static=True,
            )
        else:
            vertices, faces = unit_mesh(batch.shape)
            count = len(batch.centre)
            offset = np.arange(count, dtype=np.uint32)[:, None, None] * np.uint32(len(vertices))
            mesh = rr.Mesh3D(
                vertex_positions=_placed(batch, vertices).reshape(-1, 3),
                triangle_indices=(faces[None] + offset).reshape(-1, 3),
                vertex_colors=np.repeat(batch.colour, len(vertices), axis=0),
            )
            recording.log(f"{path}/{batch.shape}", mesh, static=True)


def _placed(batch: Batch, vertices: Floats32) -> Floats32:
    """The unit shape's vertices (V, 3) at every solid, float32 (N, V, 3)."""
    scaled = vertices[None] * batch.size_m[:, None]
    cos, sin = np.cos(batch.yaw_rad)[:, None], np.sin(batch.yaw_rad)[:, None]
    x, y = scaled[..., 0], scaled[..., 1]
    turned = np.stack([cos * x - sin * y, sin * x + cos * y, scaled[..., 2]], axis=-1)
    return (turned + batch.centre[:, None]).astype(np.float32)
