"""Geometry of the toy house: wall lengths that add up, openings at doors, furniture of the right size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from toy import toy_plan

from dashboards.geometry.floors import floors
from dashboards.geometry.furniture import KINDS, WORDS, furniture_solids, kind_of, solids_of
from dashboards.geometry.house import house_shape
from dashboards.geometry.marks import dashes, path_segments, segments
from dashboards.geometry.occupancy import occupancy_mesh
from dashboards.geometry.solids import SHAPES, Solid, batches, unit_mesh
from dashboards.geometry.walls import CAP_M, wall_solids
from dashboards.palette import WALL
from workbench.belief_colours import belief_colours
from workbench.worlds.geometry import Pose
from workbench.worlds.house import Furniture, RoomId
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.walls import gaps_of

PLAN = toy_plan()


def test_floors_cover_their_rooms() -> None:
    for floor in floors(PLAN):
        corners = floor.vertices[floor.faces]
        sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        areas = np.cross(sides[0], sides[1])[:, 2] / 2
        assert (areas > 0).all(), "floors face up"
        assert areas.sum() == pytest.approx(16.0)


def test_a_room_that_is_not_convex_is_covered_too() -> None:
    bent = replace(PLAN.rooms[0], floor=((0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)))
    (floor, _) = floors(replace(PLAN, rooms=(bent, PLAN.rooms[1])))
    corners = floor.vertices[floor.faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert areas.sum() == pytest.approx(12.0)


def test_the_door_is_a_hole_in_the_wall_between_the_rooms() -> None:
    wall = next(w for w in PLAN.walls if w.id == "w5")
    (gap,) = gaps_of(wall, PLAN)
    assert (gap.start_m, gap.end_m) == pytest.approx((1.5, 2.5))
    middle = _walls_at(4.0, 2.0, z=0.5)
    assert middle == [], "nothing stands in the doorway"
    assert _walls_at(4.0, 3.0, z=0.5), "beside it the wall stands"
    assert _walls_at(4.0, 2.0, z=2.3, cut_m=None), "above it too"


def test_the_window_is_a_hole_between_its_sill_and_its_top() -> None:
    assert _walls_at(1.5, 0.0, z=0.5, cut_m=None)
    assert not _walls_at(1.5, 0.0, z=1.5, cut_m=None)
    assert _walls_at(1.5, 0.0, z=2.3, cut_m=None)


def test_a_wall_listed_from_both_sides_is_drawn_once() -> None:
    turned = tuple(replace(w, id=w.id + "'", start=w.end, end=w.start) for w in PLAN.walls)
    assert len(wall_solids(replace(PLAN, walls=PLAN.walls + turned))) == len(wall_solids(PLAN))


def test_empty_walls_and_points_are_left_out() -> None:
    odd = (replace(PLAN.walls[0], empty=True), replace(PLAN.walls[0], end=PLAN.walls[0].start))
    assert wall_solids(replace(PLAN, walls=odd)) == ()


def test_cut_walls_end_at_the_cut() -> None:
    for solid in wall_solids(PLAN, cut_m=0.75):
        assert solid.centre[2] + solid.size_m[2] / 2 <= 0.75 + CAP_M


def test_furniture_keeps_within_its_size_and_place() -> None:
    for i, container in enumerate(PLAN.containers):
        solids = [s for s in furniture_solids(PLAN) if s.owner == i]
        assert solids, container.id
        low = np.min([np.array(s.centre) - np.array(s.size_m) / 2 for s in solids], axis=0)
        high = np.max([np.array(s.centre) + np.array(s.size_m) / 2 for s in solids], axis=0)
        middle = np.array([container.pose.x_m, container.pose.y_m])
        half = np.array(container.size_m[:2]) / 2
        assert (low[:2] >= middle - half - 0.06).all()
        assert (high[:2] <= middle + half + 0.06).all()
        assert high[2] <= container.size_m[2] * 1.06


@pytest.mark.parametrize("name", [*KINDS, *(word for word, _ in WORDS), "something new"])
def test_every_kind_can_be_built_at_any_size(name: str) -> None:
    for size in ((0.0, 0.0, 0.0), (0.4, 0.5, 0.9), (3.0, 2.0, 2.2)):
        piece = Furniture(id="f", type=name, room=RoomId("r"), pose=Pose(x_m=1, y_m=2, yaw_rad=0.7), size_m=size)
        for solid in solids_of(piece, owner=0):
            assert np.isfinite(solid.centre).all()
            assert min(solid.size_m) > 0
            assert solid.shape in SHAPES


def test_kinds_are_found_by_name_and_by_word() -> None:
    assert kind_of("Bed") is kind_of("ObjaBed") is KINDS["bed"]
    assert kind_of("ObjaBookshelf") is kind_of("ShelvingUnit")
    assert kind_of("Gizmo") is kind_of("Thing")


def test_a_turned_piece_turns_about_its_middle() -> None:
    piece = Furniture(
        id="f", type="Gizmo", room=RoomId("r"), pose=Pose(x_m=2, y_m=3, yaw_rad=1.0), size_m=(1, 2, 3), base_m=0.5
    )
    (solid,) = solids_of(piece, owner=-1)
    assert solid.centre == pytest.approx((2, 3, 2.0))
    assert solid.yaw_rad == pytest.approx(1.0)


@pytest.mark.parametrize("shape", SHAPES)
def test_unit_shapes_are_closed_and_face_outwards(shape: str) -> None:
    vertices, faces = unit_mesh(shape)  # type: ignore[arg-type]
    corners = vertices[faces].astype(np.float64)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx({"box": 1.0, "cylinder": np.pi / 4, "ball": np.pi / 6}[shape], rel=0.06)
    assert np.abs(vertices).max() == pytest.approx(0.5)


def test_batches_colour_what_has_an_owner() -> None:
    solids = [Solid("box", (0, 0, 0), (1, 1, 1), owner=1), Solid("box", (0, 0, 0), (1, 1, 1), colour=(9, 9, 9))]
    (batch,) = batches(solids)
    colours = batch.coloured(np.array([[1, 2, 3], [4, 5, 6]], dtype=np.uint8))
    assert colours.tolist() == [[4, 5, 6], [9, 9, 9]]


def test_a_house_is_a_handful_of_batches() -> None:
    shape = house_shape(PLAN)
    assert len(shape.furniture) <= len(SHAPES)
    assert len(shape.cut_walls) == len(shape.whole_walls) == 1
    assert shape.centre == (4.0, 2.0)


def test_dashes_cover_their_share_of_a_way() -> None:
    way = np.array([[0.0, 0.0], [3.8, 0.0]])
    made = dashes(way, 0.1)
    assert len(made) == 10
    assert np.hypot(*(made[:, 1] - made[:, 0])[:, :2].T).sum() == pytest.approx(2.2, abs=0.01)


def test_assumed_stretches_are_dashed() -> None:
    way = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    assert len(path_segments(way, np.array([False, False, False]), 0.0)) == len(segments(way, 0.0)) == 2
    assert len(path_segments(way, np.array([False, False, True]), 0.0)) == 1 + 3


def test_more_belief_is_darker_all_along_the_scale() -> None:
    shades = belief_colours(np.linspace(0, 1, 64)).astype(float) @ np.array([0.2126, 0.7152, 0.0722])
    assert (np.diff(shades) <= 0.5).all()
    assert shades[0] - shades[-1] > 100


def _walls_at(x: float, y: float, *, z: float, cut_m: float | None = 0.75) -> list[Solid]:
    """The wall boxes that a point lies in."""
    return [s for s in wall_solids(PLAN, cut_m=cut_m) if s.colour == WALL and _inside(s, (x, y, z))]


def _inside(solid: Solid, point: tuple[float, float, float]) -> bool:
    c, s = np.cos(-solid.yaw_rad), np.sin(-solid.yaw_rad)
    dx, dy, dz = (p - q for p, q in zip(point, solid.centre, strict=True))
    local = (c * dx - s * dy, s * dx + c * dy, dz)
    return all(abs(v) <= size / 2 + 1e-9 for v, size in zip(local, solid.size_m, strict=True))


def test_the_occupancy_layer_covers_the_occupied_cells() -> None:
    cells = np.zeros((3, 5), dtype=bool)
    cells[0, :2] = cells[0, 4] = cells[2, 1:] = True
    made = occupancy_mesh(OccupancyGrid(origin=(1.0, 2.0), resolution_m=0.5, occupied=cells))
    assert made is not None
    vertices, faces = made
    assert len(faces) == 2 * 3, "one rectangle a stretch"
    corners = vertices[faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert areas.sum() == pytest.approx(7 * 0.25)
    assert vertices[:, :2].min(axis=0).tolist() == [1.0, 2.0]
    assert vertices[:, :2].max(axis=0).tolist() == [3.5, 3.5]
    assert (
        occupancy_mesh(OccupancyGrid(origin=(0, 0), resolution_m=1.0, occupied=np.zeros((2, 2), dtype=bool))) is None
    )
