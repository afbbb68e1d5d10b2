"""From where a container of the toy house is seen: within the radius, with no wall between, through the door."""

from __future__ import annotations

from math import inf, nan

import pytest
from toy import BED, TABLE, toy_plan

from workbench.errors import BadValue
from workbench.worlds.sight.lines_of_sight import LinesOfSight, checked_radius

TABLE_POINT = (2.0, 0.8)
"""The centre of the dining table."""


@pytest.mark.parametrize(("point", "seen"), [((2.0, 2.25), True), ((2.0, 2.45), False), ((3.4, 0.85), True)])
def test_it_is_seen_within_the_radius(point: tuple[float, float], seen: bool) -> None:
    plan = toy_plan()
    assert LinesOfSight(plan, 1.5).sees(plan.container(TABLE), point) == seen


def test_walls_block_and_doors_do_not() -> None:
    """The bed, at (6.8, 3.0), from the kitchen: the line from (3.5, 2.0) passes the door at y = 2.15, that from
    (3.5, 3.5) meets the wall."""
    plan = toy_plan()
    lines = LinesOfSight(plan, 5.0)
    assert lines.sees(plan.container(BED), (3.5, 2.0))
    assert not lines.sees(plan.container(BED), (3.5, 3.5))
    assert not lines.sees(plan.container(TABLE), (4.5, 3.5))


def test_nothing_is_seen_from_outside_the_map() -> None:
    plan = toy_plan()
    assert not LinesOfSight(plan, 50.0).sees(plan.container(TABLE), (-40.0, 2.0))


@pytest.mark.parametrize("radius_m", [-1.0, nan, inf, 1e6])
def test_bad_radii_are_refused(radius_m: float) -> None:
    with pytest.raises(BadValue, match="sight radius"):
        checked_radius(radius_m)
    with pytest.raises(BadValue, match="sight radius"):
        LinesOfSight(toy_plan(), radius_m)
