"""Walls, floors and belief colours are the same in the viewer channels of logs and in the dashboard."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from dashboards.geometry.floors import floors
from dashboards.geometry.walls import wall_solids
from dashboards.palette import WALL
from recorders.foxglove.scene import belief_colour, scene
from workbench.belief_colours import belief_colours
from workbench.worlds.house import FloorPlan
from workbench.worlds.procthor.load import load_house
from workbench.worlds.walls import REACH_M, gaps_of, line_of, pieces_of, standing_walls


@pytest.fixture(scope="module")
def plan() -> FloorPlan:
    return load_house("houses:3").plan


def test_both_draw_the_same_pieces_of_walls(plan: FloorPlan) -> None:
    (walls,) = [entity for entity in scene(plan, 0).entities if entity.id == "walls"]
    drawn = {(round(c.pose.position.x, 2), round(c.pose.position.y, 2), round(c.size.x, 2)) for c in walls.cubes}
    shown = {
        (round(s.centre[0], 2), round(s.centre[1], 2), round(s.size_m[0], 2))
        for s in wall_solids(plan, cut_m=None)
        if s.colour == WALL
    }
    assert len(drawn) > 20
    assert all(min(hypot(a[0] - b[0], a[1] - b[1]) + abs(a[2] - b[2]) for b in shown) < 0.03 for a in drawn)
    assert len(walls.cubes) == sum(s.colour == WALL for s in wall_solids(plan, cut_m=None))


def test_a_door_in_the_line_of_the_other_room_opens_the_wall(plan: FloorPlan) -> None:
    wall = next(w for w in standing_walls(plan) if any(gap.is_door for gap in gaps_of(w, plan)))
    (door, *_) = [gap.opening for gap in gaps_of(wall, plan) if gap.is_door]
    dx, dy = line_of(wall).along

    def doors_when_off(away_m: float) -> int:
        moved = replace(
            door,
            start=(door.start[0] - dy * away_m, door.start[1] + dx * away_m),
            end=(door.end[0] - dy * away_m, door.end[1] + dx * away_m),
        )
        return len(gaps_of(wall, replace(plan, doors=(moved,), windows=())))

    assert (doors_when_off(0.2), doors_when_off(REACH_M + 0.01)) == (1, 0)


def test_pieces_leave_exactly_the_openings(plan: FloorPlan) -> None:
    for wall in standing_walls(plan):
        line, gaps = line_of(wall), gaps_of(wall, plan)
        whole = [p for p in pieces_of(line, gaps, top_m=wall.height_m) if p.high_m - p.low_m == wall.height_m]
        for gap in gaps:
            assert not any(p.start_m < gap.end_m - 0.02 and p.end_m > gap.start_m + 0.02 for p in whole)


def test_both_draw_the_same_floors(plan: FloorPlan) -> None:
    """Triangle by triangle, but for the rounding of the channel to 1/1024 m."""
    entities = {entity.id: entity for entity in scene(plan, 0).entities}
    for floor in floors(plan):
        (mesh,) = entities[f"room/{floor.room}"].triangles
        drawn = np.array([(mesh.points[i].x, mesh.points[i].y) for i in mesh.indices])
        assert drawn == pytest.approx(floor.vertices[:, :2], abs=1e-3)


def test_belief_colours_are_those_of_matplotlib_s_magma() -> None:
    from matplotlib import colormaps

    at = 1.0 - np.linspace(0.03, 0.80, 256)
    expected = np.round(np.asarray(colormaps["magma"](at))[:, :3] * 255)
    assert (belief_colours(np.arange(256) / 255) == expected).all()


@pytest.mark.parametrize("probability", [0.0, 0.01, 0.25, 1.0, 2.0])
def test_both_colour_beliefs_by_one_scale(probability: float) -> None:
    shown = belief_colours(min(probability, 1.0) ** 0.5) / 255
    colour = belief_colour(probability)
    assert (colour.r, colour.g, colour.b) == pytest.approx(tuple(shown), abs=1 / 200)
