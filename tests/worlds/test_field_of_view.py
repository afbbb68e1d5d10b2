"""The field of view in the toy house: round in the open, cut off by walls, through the open door."""

from __future__ import annotations

import numpy as np
import pytest
from toy import toy_plan

from workbench.errors import BadValue
from workbench.worlds.sight.field_of_view import RAYS, FieldOfView
from workbench.worlds.sight.lines_of_sight import LinesOfSight


def test_in_the_open_it_is_a_circle() -> None:
    outline = FieldOfView(toy_plan(), 1.0).outline((2.0, 2.0))
    assert outline.shape == (RAYS, 2)
    assert np.hypot(*(outline - [2.0, 2.0]).T) == pytest.approx(np.ones(RAYS))
    assert outline[0].tolist() == pytest.approx([3.0, 2.0])
    assert outline[RAYS // 4].tolist() == pytest.approx([2.0, 3.0])


def test_walls_cut_it_off_and_the_open_door_lets_it_pass() -> None:
    """From (3, 2) with a sight of 3 m: 2 m to the wall in the north, through the door to (6, 2) in the east, to the
    inner wall at x = 4 in the north-east."""
    outline = FieldOfView(toy_plan(), 3.0).outline((3.0, 2.0))
    east, north_east, north = outline[0], outline[RAYS // 8], outline[RAYS // 4]
    assert east.tolist() == pytest.approx([6.0, 2.0])
    assert north[1] == pytest.approx(4.0, abs=0.11)
    assert north_east.tolist() == pytest.approx([4.0, 3.0], abs=0.15)


def test_what_lies_within_is_what_the_lines_of_sight_see() -> None:
    """The centre of every open container, from points all over the kitchen, but for those at the very edge."""
    plan = toy_plan()
    lines, field = LinesOfSight(plan, 2.5), FieldOfView(plan, 2.5)
    checked = 0
    for x in np.arange(0.6, 3.6, 0.4):
        for y in np.arange(1.3, 3.0, 0.4):
            outline = field.outline((x, y))
            far_m = np.hypot(*(outline - [x, y]).T)
            for container in lines.open:
                dx, dy = container.pose.x_m - x, container.pose.y_m - y
                ray = round(np.arctan2(dy, dx) % (2 * np.pi) / (2 * np.pi) * RAYS) % RAYS
                near = (
                    min(far_m[ray - 1], far_m[ray], far_m[(ray + 1) % RAYS]),
                    max(far_m[ray - 1 : ray + 2], default=0),
                )
                if np.hypot(dx, dy) < near[0] - 0.2 or np.hypot(dx, dy) > near[1] + 0.2:
                    checked += 1
                    assert lines.sees(container, (x, y)) == (np.hypot(dx, dy) < near[0])
    assert checked > 60


def test_a_far_sight_ends_at_the_walls_of_the_house() -> None:
    field = FieldOfView(toy_plan(), 100.0)
    outline = field.outline((1.0, 2.0))
    assert outline[:, 0].min() > -0.2
    assert outline[:, 0].max() < 8.2
    assert field.steps < 250, "no ray is longer than the house"


def test_a_bad_radius_is_refused() -> None:
    with pytest.raises(BadValue, match="sight radius"):
        FieldOfView(toy_plan(), -1.0)
