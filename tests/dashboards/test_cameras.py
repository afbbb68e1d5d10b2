"""Poses of the camera: where it stands, and what is in the middle of its picture."""

from __future__ import annotations

from math import cos, pi, sin, tan

import pytest

from dashboards.geometry.room_names import PictureView
from dashboards.model.scene import RobotState
from dashboards.viser_app.cameras import FIELD_OF_VIEW, behind


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, pi, -2.5])
def test_the_robot_that_is_followed_is_in_the_middle_and_walks_away(yaw_rad: float) -> None:
    robot = RobotState(x_m=3.0, y_m=-2.0, yaw_rad=yaw_rad, holding="")
    pose = behind(robot)
    view = PictureView(
        position=pose.position, look_at=pose.look_at, half_tan=tan(FIELD_OF_VIEW / 2), width=560, height=480
    )
    at = view.pixel((robot.x_m, robot.y_m, 0.45))
    ahead = view.pixel((robot.x_m + cos(yaw_rad), robot.y_m + sin(yaw_rad), 0.45))
    assert at is not None
    assert ahead is not None
    assert at == pytest.approx((280, 240), abs=10)
    assert ahead[1] < at[1] - 20
    assert ahead[0] == pytest.approx(280, abs=2)
