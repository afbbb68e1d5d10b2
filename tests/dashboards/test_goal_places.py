"""Frames around places of the goal: containers on their tops, spots on the floor, nothing for what is unknown."""

from __future__ import annotations

import numpy as np
from toy import COUNTER, toy_plan
from toy_run import STANDING, toy_place

from dashboards.geometry.goal_places import SPOT_M, goal_frames
from workbench.planning.tasks import AllOf, Delivered, Task
from workbench.worlds.house import START, ItemType, LocationId


def _task(*places: str) -> Task:
    parts = tuple(Delivered(item_type=ItemType("Mug"), at=LocationId(at)) for at in places)
    return Task(scenario="deliver", goal=AllOf(parts=parts), failure_cost=1.0, budget_s=1.0)


def test_a_container_is_framed_on_its_top() -> None:
    (frame,) = goal_frames(toy_place(), _task(COUNTER))
    counter = next(c for c in toy_plan().containers if c.id == COUNTER)
    low, high = frame[0].min(axis=0), frame[0].max(axis=0)
    assert np.allclose((low + high)[:2] / 2, [counter.pose.x_m, counter.pose.y_m], atol=1e-3)
    assert abs((low + high)[2] / 2 - counter.base_m - counter.size_m[2]) < 0.01
    assert np.all((high - low)[:2] > sorted(counter.size_m[:2])[0])


def test_a_spot_on_the_floor_is_framed_where_the_robot_stands() -> None:
    (frame,) = goal_frames(toy_place(), _task(START))
    middle = (frame[0].min(axis=0) + frame[0].max(axis=0)) / 2
    assert np.allclose(middle[:2], [STANDING[START].x_m, STANDING[START].y_m], atol=1e-3)
    assert np.ptp(frame[0][:, 0]) > SPOT_M


def test_several_places_have_several_frames_and_unknown_ones_none() -> None:
    assert len(goal_frames(toy_place(), _task(COUNTER, START, COUNTER))) == 2
    assert goal_frames(toy_place(), _task("Nowhere|1")) == ()
