"""Names of rooms: on their own floor, not behind walls, not over numbers; the view's geometry by hand."""

from __future__ import annotations

from math import tan
from pathlib import Path

import numpy as np
import pytest
import shapely

from dashboards.geometry.floors import floors
from dashboards.geometry.house import house_shape
from dashboards.geometry.room_names import Box, PictureView, label_box, room_name_places
from dashboards.viser_app.cameras import FIELD_OF_VIEW, fitted
from replayers.runs.run import read

PLAN = read(Path(__file__).resolve().parents[2] / "logs" / "breakfast.mcap").place.plan
FLOORS = floors(PLAN)
NAMES = [floor.kind for floor in FLOORS]
ABOVE = PictureView(position=(2.0, 3.0, 10.0), look_at=(2.0, 3.0, 0.0), half_tan=0.5, width=200, height=100)


def _view(*, from_above: bool = False, width: float = 1000.0) -> PictureView:
    pose = fitted(house_shape(PLAN), aspect=width / 700, from_above=from_above)
    half = tan(FIELD_OF_VIEW / 2)
    return PictureView(position=pose.position, look_at=pose.look_at, half_tan=half, width=width, height=700)


def test_a_view_from_above_by_hand() -> None:
    """Ten metres up, half of the picture's 100 pixels is 5 m."""
    assert ABOVE.pixel((2.0, 3.0, 0.0)) == pytest.approx((100, 50))
    assert ABOVE.pixel((3.0, 4.0, 0.0)) == pytest.approx((110, 40))
    assert ABOVE.floor_at(110, 40) == pytest.approx((3.0, 4.0))
    assert ABOVE.pixel((2.0, 3.0, 11.0)) is None
    level = PictureView(position=(0.0, 0.0, 1.0), look_at=(5.0, 0.0, 1.0), half_tan=0.5, width=200, height=100)
    assert level.floor_at(100, 20) is None, "above the horizon is no floor"


def test_pixels_and_floor_are_inverse() -> None:
    view = _view()
    for floor in FLOORS:
        pixel = view.pixel((*floor.label_at, 0.0))
        assert pixel is not None
        assert view.floor_at(*pixel) == pytest.approx(floor.label_at, abs=1e-6)


@pytest.mark.parametrize("wall_m", [0.0, 0.75, 2.7])
@pytest.mark.parametrize("width", [440.0, 1000.0])
@pytest.mark.parametrize("from_above", [False, True])
def test_names_stand_on_their_own_floor_with_any_walls(wall_m: float, width: float, *, from_above: bool) -> None:
    view = _view(from_above=from_above, width=width)
    places = room_name_places(FLOORS, NAMES, view, wall_m=wall_m, taken=[])
    assert sum(place is not None for place in places) >= len(FLOORS) - 2
    for floor, place in zip(FLOORS, places, strict=True):
        if place is None:
            continue
        assert shapely.contains_xy(floor.polygon, *place)
        away = np.array(view.position[:2]) - np.array(place)
        seen = np.array(place) + away * wall_m / view.position[2]
        if width > 500:
            assert floor.polygon.contains(shapely.LineString([place, seen])), "a wall is before it"


def test_names_give_way_to_numbers() -> None:
    view = _view()
    free = room_name_places(FLOORS, NAMES, view, wall_m=0.75, taken=[])
    taken: list[Box] = []
    for place in free:
        assert place is not None
        box = label_box((*place, 0.0), "1. countertop", view)
        assert box is not None
        taken.append(box)
    moved = room_name_places(FLOORS, NAMES, view, wall_m=0.75, taken=taken)
    for name, before, after in zip(NAMES, free, moved, strict=True):
        assert after != before
        if after is None:
            continue
        at = view.pixel((*after, 0.05))
        assert at is not None
        half = len(name) * 3.2
        assert not any(
            l < at[0] + half and at[0] - half < r and t < at[1] + 8 and at[1] - 8 < b for l, t, r, b in taken
        )
    everywhere = [(-1e4, -1e4, 1e4, 1e4)]
    assert room_name_places(FLOORS, NAMES, view, wall_m=0.0, taken=everywhere) == [None] * len(FLOORS)
