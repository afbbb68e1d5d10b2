"""What stands still in a house has its light in its colours, and is one file of two layers that viewers can read."""

from __future__ import annotations

from json import loads
from math import pi
from struct import unpack_from

import numpy as np
import pytest

from dashboards.geometry.lit.daylight import LAMPS, SKY_INTENSITY, radiance
from dashboards.geometry.lit.glb import Layer, glb
from dashboards.geometry.lit.lit_mesh import LitMesh, lit_solids, lit_tops, merged, unit_normals
from dashboards.geometry.solids import SHAPES, Solid, batches, unit_mesh

WHITE, UP = np.full((1, 3), 255, dtype=np.uint8), np.array([[0.0, 0.0, 1.0]])


def test_a_face_turned_away_from_all_lamps_has_the_light_of_the_sky_alone() -> None:
    """Half sky, half ground: linear (1.0, 0.479) for the reds 250 and 190 of 255, times 1.9, over pi."""
    down = radiance(WHITE, -UP)[0, 0]
    sky, ground = ((250 / 255 + 0.055) / 1.055) ** 2.4, ((190 / 255 + 0.055) / 1.055) ** 2.4
    assert down == pytest.approx(SKY_INTENSITY * (sky + ground) / 2 / pi)
    assert radiance(WHITE, UP)[0, 0] > down


@pytest.mark.parametrize("lamp", LAMPS, ids=lambda lamp: lamp.name)
def test_nothing_is_brighter_than_what_faces_a_lamp(lamp: object) -> None:
    towards = np.array(lamp.position) / np.linalg.norm(lamp.position)  # type: ignore[attr-defined]
    tilted = towards + np.array([0.0, 0.0, 0.6])
    grey = np.full((2, 3), 120, dtype=np.uint8)
    alone = radiance(grey, np.stack([towards, tilted / np.linalg.norm(tilted)]))
    assert np.all(alone > radiance(grey, np.stack([-towards, -towards])))


@pytest.mark.parametrize("shape", SHAPES)
def test_normals_point_outwards_and_have_length_1(shape: str) -> None:
    normals, (points, _) = unit_normals(shape), unit_mesh(shape)  # type: ignore[arg-type]
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0)
    assert np.all((normals * points).sum(axis=1) > 0)


def test_solids_are_where_they_stand_and_turned() -> None:
    """A bar of 4 m by 2 m by 1 m, turned by a quarter: 2 m along x, 4 m along y."""
    bar = lit_solids(batches([Solid("box", (10.0, 20.0, 0.5), (4.0, 2.0, 1.0), pi / 2, (200, 0, 0))]))
    assert np.allclose(bar.vertices.min(axis=0), (9.0, 18.0, 0.0), atol=1e-5)
    assert np.allclose(bar.vertices.max(axis=0), (11.0, 22.0, 1.0), atol=1e-5)
    assert len(bar.faces) == 12
    top, side = bar.colours[bar.vertices[:, 2] > 0.9], bar.colours[bar.vertices[:, 2] < 0.1]
    assert top[:, 0].max() > side[:, 0].max(), "the sun stands high"


def test_of_shade_only_the_upper_side_is_drawn() -> None:
    shade = lit_tops(batches([Solid("box", (1.0, 2.0, 0.1), (2.0, 1.0, 0.2), 0.0, (30, 32, 48))]))
    assert len(shade.faces) == 2
    assert np.allclose(shade.vertices[:, 2], 0.2)
    a, b, c = (shade.vertices[shade.faces[:, i]] for i in range(3))
    assert np.all(np.cross(b - a, c - a)[:, 2] > 0), "seen from above"


def triangle(z: float, colour: float) -> LitMesh:
    return LitMesh(
        vertices=np.array([[0, 0, z], [1, 0, z], [0, 1, z]], dtype=np.float32),
        colours=np.full((3, 3), colour, dtype=np.float32),
        faces=np.array([[0, 1, 2]], dtype=np.uint32),
    )


def test_the_file_holds_points_colours_and_faces_as_given() -> None:
    solid = merged([triangle(0.0, 0.5), triangle(1.0, 1.25)])
    content = glb([Layer(mesh=solid), Layer(mesh=triangle(2.0, 0.2), opacity=0.07), Layer(mesh=merged([]))])
    magic, version, length = unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    (words,) = unpack_from("<I", content, 12)
    head, binary = loads(content[20 : 20 + words]), content[28 + words :]
    assert len(binary) == head["buffers"][0]["byteLength"]
    first, second = head["meshes"][0]["primitives"]

    def read(accessor: int) -> np.ndarray:
        one = head["accessors"][accessor]
        view = head["bufferViews"][one["bufferView"]]
        kind = {5126: np.float32, 5123: np.uint16, 5125: np.uint32}[one["componentType"]]
        wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[one["type"]]
        return np.frombuffer(binary, kind, one["count"] * wide, view["byteOffset"]).reshape(-1, wide)

    assert np.array_equal(read(first["attributes"]["POSITION"]), solid.vertices)
    assert read(first["indices"]).ravel().tolist() == [0, 1, 2, 3, 4, 5]
    paint = head["materials"][first["material"]]
    factor = paint["pbrMetallicRoughness"]["baseColorFactor"]
    seen = read(first["attributes"]["COLOR_0"])[:, :3] / 65535 * factor[0]
    assert np.allclose(seen, solid.colours, atol=1e-4)
    assert (paint["alphaMode"], factor[3], paint["extensions"]) == ("OPAQUE", 1.0, {"KHR_materials_unlit": {}})
    shade = head["materials"][second["material"]]
    assert (shade["alphaMode"], shade["pbrMetallicRoughness"]["baseColorFactor"][3]) == ("BLEND", 0.07)
    assert all(view["byteOffset"] % 4 == 0 for view in head["bufferViews"])
