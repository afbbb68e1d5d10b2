"""Whether a wall stands between two points."""

from __future__ import annotations

import pytest
from toy import toy_plan

from workbench.worlds.geometry import Point
from workbench.worlds.sight.clear_line import clear_line


@pytest.mark.parametrize(
    ("a", "b", "clear"),
    [
        ((1.0, 2.0), (2.0, 0.8), True),  # start and table, both in the kitchen
        ((2.0, 3.6), (6.0, 3.6), False),  # through the wall between kitchen and bedroom
        ((1.0, 2.0), (6.0, 2.0), True),  # through the door in it
    ],
)
def test_walls_block_the_view_and_doors_do_not(a: Point, b: Point, clear: bool) -> None:
    assert clear_line(toy_plan(), a, b) == clear
    assert clear_line(toy_plan(), b, a) == clear
