"""A robot's path from its own poses: it stands where it stood, jitter is not walking, simulated runs keep their
paths."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.timestamp_pb2 import Timestamp
from toy_run import ns, toy_run

from dashboards.model.paths.odometry_path import path_of_poses
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from replayers.runs.run import Run, read

SPOT = Path(__file__).resolve().parents[2] / "logs" / "spot-home-A.mcap"


def pose(second: float, x: float, frame: str = "map") -> tuple[int, bytes]:
    at = ns(second)
    made = PoseInFrame(frame_id=frame, timestamp=Timestamp(seconds=at // 10**9, nanos=at % 10**9))
    made.pose.position.x, made.pose.position.y, made.pose.orientation.w = x, 2.0, 1.0
    return at, made.SerializeToString()


def robot(*poses: tuple[int, bytes], source: str = "spot") -> Run:
    ours = toy_run()
    return replace(ours, info=msgspec.structs.replace(ours.info, source=source), raw_poses=poses)


def test_the_robot_is_where_it_said_it_was() -> None:
    timeline = timeline_of(robot(pose(1, 1.0), pose(2, 2.0), pose(3, 3.0)))
    for second, x in ((0.0, 1.0), (1.5, 1.5), (2.5, 2.5), (9.0, 3.0)):
        assert scene_at(timeline, ns(second)).robot.x_m == pytest.approx(x)
    assert timeline.path_m[-1] == pytest.approx(2.0)
    assert not timeline.imputed.any()


def test_a_pause_is_a_pause() -> None:
    """It stands at 1 m until a moment before the pose at 6 s: it did not creep there."""
    timeline = timeline_of(robot(pose(0, 0.0), pose(1, 1.0), pose(6, 1.2), pose(7, 2.0)))
    assert scene_at(timeline, ns(4)).robot.x_m == pytest.approx(1.0)
    assert scene_at(timeline, ns(6)).robot.x_m == pytest.approx(1.2)


def test_trembling_is_no_walking() -> None:
    shaking = [pose(i / 10, 0.01 * (i % 2)) for i in range(100)]
    timeline = timeline_of(robot(*shaking, pose(11, 1.0)))
    assert timeline.path_m[-1] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    "run",
    [
        robot(pose(1, 1.0), pose(2, 2.0), source="simulation"),
        robot(pose(1, 1.0), pose(2, 2.0), source="replay"),
        robot(pose(1, 1.0)),
        robot(pose(1, 1.0, "odom"), pose(2, 2.0, "odom")),
        robot((ns(1), b"\xff\xff"), (ns(2), b"\xff")),
        robot(pose(1, float("nan")), pose(2, 2.0)),
        robot(pose(-9, 1.0), pose(99, 2.0)),
    ],
)
def test_otherwise_the_way_is_that_of_the_actions(run: Run) -> None:
    assert path_of_poses(run, ns(0), ns(15)) is None
    assert timeline_of(run).path_m[-1] == pytest.approx(timeline_of(toy_run()).path_m[-1])


def test_the_sample_of_a_spot_walks_about_as_far_as_its_actions_say() -> None:
    run = read(SPOT)
    timeline = timeline_of(run)
    walked = sum(action.travel_m for action in run.actions)
    assert timeline.path_m[-1] == pytest.approx(walked, rel=0.2)
    assert (np.diff(timeline.path_s) >= 0).all()
