"""What does not change in a house as one mesh, its light already in its colours.

A viewer draws it in one go and without a lamp: on a machine without a graphics card that takes a small part of the
time that lit solids take.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dashboards.geometry.floors import Floor
from dashboards.geometry.lit.daylight import radiance
from dashboards.geometry.marks import Mesh
from dashboards.geometry.solids import Batch, Shape, unit_mesh
from dashboards.palette import Colour
from workbench.arrays import AnyArray, Floats, Floats32, Uints32
from workbench.tolerances import DEGENERATE, MIN_LENGTH_M


@dataclass(frozen=True, slots=True, kw_only=True)
class LitMesh:
    """A mesh with a colour at each vertex.

    Attributes:
        vertices: float32 (V, 3). faces: uint32 (F, 3).
        colours: the light that each vertex sends to the camera, linear RGB before tone mapping, float32 (V, 3).
    """

    vertices: Floats32
    colours: Floats32
    faces: Uints32


def lit_solids(batches: Iterable[Batch]) -> LitMesh:
    """Solids as they look in daylight."""
    return merged([_of_batch(batch) for batch in batches])


def lit_tops(batches: Iterable[Batch]) -> LitMesh:
    """The upper faces of boxes, for flat layers of which nothing else is seen."""
    flat: list[LitMesh] = []
    for batch in batches:
        low = batch.centre - batch.size_m * np.array([0.0, 0.0, 0.5], dtype=np.float32)
        corners = np.array([[-0.5, -0.5, 1], [0.5, -0.5, 1], [0.5, 0.5, 1], [-0.5, 0.5, 1]], dtype=np.float32)
        vertices = _turned(corners[None] * batch.size_m[:, None], batch) + low[:, None]
        up = np.tile(np.array([0.0, 0.0, 1.0]), (4 * len(low), 1))
        faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)[None] + (4 * np.arange(len(low)))[:, None, None]
        flat.append(
            LitMesh(
                vertices=vertices.reshape(-1, 3).astype(np.float32),
                colours=radiance(np.repeat(batch.colour, 4, axis=0), up).astype(np.float32),
                faces=faces.reshape(-1, 3).astype(np.uint32),
            )
        )
    return merged(flat)


def lit_floors(floors: Iterable[Floor]) -> LitMesh:
    """Floors as they look in daylight, from above and from below."""
    made: list[LitMesh] = []
    for floor in floors:
        up = np.tile(np.array([0.0, 0.0, 1.0]), (len(floor.vertices), 1))
        paint = np.tile(np.array(floor.colour, dtype=np.uint8), (len(floor.vertices), 1))
        for normals, faces in ((up, floor.faces), (-up, floor.faces[:, ::-1])):
            colours = radiance(paint, normals).astype(np.float32)
            made.append(LitMesh(vertices=floor.vertices, colours=colours, faces=faces))
    return merged(made)


def lit_mesh(mesh: Mesh, colour: Colour) -> LitMesh:
    """A mesh of one colour as it looks in daylight."""
    points, faces = mesh
    paint = np.tile(np.array(colour, dtype=np.uint8), (len(points), 1))
    colours = radiance(paint, vertex_normals(points, faces)).astype(np.float32)
    return LitMesh(vertices=points, colours=colours, faces=faces)


def merged(meshes: Sequence[LitMesh]) -> LitMesh:
    """Several meshes as one, drawn in their order."""
    offsets = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    none = np.zeros((0, 3), dtype=np.float32)
    return LitMesh(
        vertices=np.concatenate([none, *(m.vertices for m in meshes)]),
        colours=np.concatenate([none, *(m.colours for m in meshes)]),
        faces=np.concatenate(
            [none.astype(np.uint32), *(m.faces + o for m, o in zip(meshes, offsets[:-1], strict=True))]
        ).astype(np.uint32),
    )


def _of_batch(batch: Batch) -> LitMesh:
    points, faces = unit_mesh(batch.shape)
    solids, corners = len(batch.centre), len(points)
    sloped = unit_normals(batch.shape)[None] / np.maximum(batch.size_m[:, None], MIN_LENGTH_M)
    sloped /= np.linalg.norm(sloped, axis=2, keepdims=True)
    vertices = _turned(points[None] * batch.size_m[:, None], batch) + batch.centre[:, None]
    normals = _turned(sloped, batch).reshape(-1, 3).astype(np.float64)
    colours = radiance(np.repeat(batch.colour, corners, axis=0), normals)
    return LitMesh(
        vertices=vertices.reshape(-1, 3).astype(np.float32),
        colours=colours.astype(np.float32),
        faces=(faces[None] + (corners * np.arange(solids))[:, None, None]).reshape(-1, 3).astype(np.uint32),
    )


@lru_cache(maxsize=8)
def unit_normals(shape: Shape) -> Floats:
    """The unit normals at the vertices of a unit shape, (V, 3)."""
    return vertex_normals(*unit_mesh(shape))


def vertex_normals(points: Floats32, faces: Uints32) -> Floats:
    """The unit normals at vertices: the means of the faces around each, by area; (V, 3)."""
    a, b, c = (points[faces[:, i]].astype(np.float64) for i in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros((len(points), 3))
    for i in range(3):
        np.add.at(normals, faces[:, i], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), DEGENERATE)


def _turned(vectors: AnyArray, batch: Batch) -> AnyArray:
    """Vectors (N, V, 3) turned by each solid's yaw."""
    c, s = np.cos(batch.yaw_rad)[:, None], np.sin(batch.yaw_rad)[:, None]
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=2)
