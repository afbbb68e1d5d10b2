"""What a bag does not support never becomes a container that was empty: for ROS 1 and ROS 2."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import pytest
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.Log_pb2 import Log

from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.worlds.sites.site import Site, load_site

sys.path.insert(0, str(Path(__file__).parent))
from standing_bag import Standing, StandingBag


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site("paper_home")


@pytest.fixture(params=[False, True], ids=["ros1", "ros2"])
def ros2(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


Import = Callable[..., tuple[dict[str, Any], Path]]


@pytest.fixture
def answer_of(site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Import:
    """Imports a bag by the paper's mapping: the JSON answer, and the log."""

    def run(odd: Standing, *more: str) -> tuple[dict[str, Any], Path]:
        bag = StandingBag(tmp_path / ("bag" if odd.ros2 else "a.bag"), odd).write(site)
        log = tmp_path / "log.mcap"
        command = ["import", str(bag), "--site", "paper_home", "-m", "paper", "-s", "none", "-o", str(log), "--json"]
        assert lios([*command, *more]) == 0
        return json.loads(capsys.readouterr().out), log

    return run


def contents(log: Path) -> dict[str, list[str]]:
    return {o.container: [i.type for i in o.items] for o in read(log).observations}


@pytest.mark.ci_but(2)
@pytest.mark.parametrize("age_s", [0.0, 3600.0])
@pytest.mark.parametrize("recorded_at_s", [0.0, 14.0])
def test_static_transforms_hold_for_all_time(
    ros2: bool, age_s: float, recorded_at_s: float, answer_of: Import
) -> None:
    """Whenever they were stamped or recorded."""
    odd = Standing(ros2=ros2, static_age_s=age_s, static_at_s=recorded_at_s)
    answer, log = answer_of(odd)
    assert contents(log) == {"countertop": ["WaterBottle"]}
    assert 14 <= answer["seconds"] <= 16
    assert answer["transforms"]["static"] == 1
    assert answer["looks"] == {"conclusive": 1, "inconclusive": []}


@pytest.mark.parametrize(
    ("camera", "linked", "reason"), [("camera", False, "camera does not lead to map"), ("", True, "no frame_id")]
)
def test_a_look_whose_detections_cannot_be_placed_is_inconclusive(
    ros2: bool, camera: str, linked: bool, reason: str, answer_of: Import
) -> None:
    answer, log = answer_of(Standing(ros2=ros2, camera=camera, linked=linked))
    assert contents(log) == {}
    assert answer["detections"]["not_placed"] == 75
    assert answer["detections"]["reasons"] == {reason: 75}
    assert [look["container"] for look in answer["looks"]["inconclusive"]] == ["countertop"]
    said = [Log.FromString(m.data).message for m in messages(log, topics=lambda topic: topic == "/log")]
    assert sum("countertop is inconclusive" in text and reason in text for text in said) == 1


def test_one_clock_is_used_and_told(ros2: bool, answer_of: Import) -> None:
    answer, log = answer_of(Standing(ros2=ros2, header_shift_s=-1_700_000_000.0))
    assert answer["clock"]["name"] == "record"
    assert "s apart" in answer["clock"]["note"]
    assert answer["seconds"] < 16
    assert contents(log) == {"countertop": ["WaterBottle"]}


def test_the_header_clock_can_be_asked_for(ros2: bool, answer_of: Import) -> None:
    odd = Standing(ros2=ros2, header_shift_s=-1_700_000_000.0)
    answer, log = answer_of(odd, "--clock", "header")
    assert answer["seconds"] < 16
    assert read(log).info.started.ns < 10**17
    assert contents(log) == {"countertop": ["WaterBottle"]}


def test_stamps_of_zero_before_the_clock_do_not_stretch_the_run(ros2: bool, answer_of: Import) -> None:
    answer, log = answer_of(Standing(ros2=ros2, zero_until_s=2.0))
    assert answer["clock"]["zero_stamps"] == 20
    assert answer["seconds"] < 16
    assert contents(log) == {"countertop": ["WaterBottle"]}


def test_the_turn_of_a_map_is_kept(ros2: bool, answer_of: Import) -> None:
    _, log = answer_of(Standing(ros2=ros2, map_yaw=pi / 2))
    grids = [Grid.FromString(m.data) for m in messages(log, topics=lambda topic: topic == "/map")]
    turn = grids[-1].pose.orientation
    assert (round(turn.z, 4), round(turn.w, 4)) == (0.7071, 0.7071)
    assert (grids[-1].pose.position.x, grids[-1].pose.position.y) == (10.0, 20.0)


def test_the_table_names_looks_detections_transforms_and_clock(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = StandingBag(tmp_path / "a.bag", Standing(ros2=False, linked=False)).write(site)
    assert lios(["import", str(bag), "--site", "paper_home", "-s", "none", "-o", str(tmp_path / "x.mcap")]) == 0
    out = capsys.readouterr().out
    for row in ("looks, inconclusive", "detections, not placed", "transforms, static", "clock"):
        assert row in out


def test_a_pose_topic_in_a_frame_that_is_nowhere_is_told_by_name(ros2: bool, answer_of: Import) -> None:
    """The robot is placed by tf; the poses of another map are not taken for it."""
    answer, log = answer_of(Standing(ros2=ros2, pose_frame="vicon_world"))
    assert answer["poses_not_placed"] == {"/amcl_pose in frame vicon_world": 75}
    assert contents(log) == {"countertop": ["WaterBottle"]}


def test_a_pose_topic_alone_in_a_frame_that_is_nowhere_is_refused_by_name(
    ros2: bool, site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = Standing(ros2=ros2, pose_frame="vicon_world", tf_until_s=0.0)
    bag = StandingBag(tmp_path / ("bag" if ros2 else "a.bag"), odd).write(site)
    log = tmp_path / "log.mcap"
    assert lios(["import", str(bag), "--site", "paper_home", "-m", "paper", "-s", "none", "-o", str(log)]) == 2
    assert "/amcl_pose in frame vicon_world" in capsys.readouterr().err
    assert not log.exists()


def test_detections_placed_by_old_transforms_are_counted_as_late(
    ros2: bool, site: Site, tmp_path: Path, answer_of: Import, capsys: pytest.CaptureFixture[str]
) -> None:
    """Transforms end after four of fifteen seconds: those of the last ten are more than a second old."""
    odd = Standing(ros2=ros2, tf_until_s=4.0)
    answer, _ = answer_of(odd)
    assert answer["detections"]["late"] == 50
    bag = next(path for path in tmp_path.iterdir() if path.name in ("bag", "a.bag"))
    table = ["import", str(bag), "--site", "paper_home", "-m", "paper", "-s", "none", "-o", str(tmp_path / "t.mcap")]
    assert lios(table) == 0
    assert "detections, placed late" in capsys.readouterr().out


def test_a_bag_of_a_new_place_needs_no_site_and_makes_a_draft_with_its_own_map(
    ros2: bool, site: Site, tmp_path: Path
) -> None:
    bag = StandingBag(tmp_path / "bag.bag", Standing(ros2=ros2, map_yaw=0.0)).write(site)
    log = tmp_path / "new.mcap"
    assert lios(["import", str(bag), "-m", "paper", "-o", str(log)]) == 0
    assert read(log).info.place == "unsurveyed"
    grids = [Grid.FromString(m.data) for m in messages(log, topics=lambda topic: topic == "/map")]
    assert [(grid.pose.position.x, grid.column_count) for grid in grids] == [(10.0, 3)]
    seen = list(messages(log, topics=lambda topic: topic == "/robot/fiducials"))
    assert 10 <= len(seen) <= 16, "tags for the draft, at most one a second"


@pytest.mark.ci
def test_a_log_without_a_planner_names_the_way_to_plan(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = StandingBag(tmp_path / "a.bag", Standing(ros2=False)).write(site)
    log = tmp_path / "a.mcap"
    assert lios(["import", str(bag), "--site", "paper_home", "-s", "none", "-o", str(log)]) == 0
    assert lios(["plan", str(log)]) == 2
    assert "-s model-lios" in capsys.readouterr().err
    assert lios(["doctor", str(log)]) == 0
    assert "simulated" not in capsys.readouterr().out


def test_the_preset_whose_frames_locate_the_robot_is_taken(
    site: Site, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By its topics the bag would be the paper's; its body is Spot's."""
    for body, code in (("body", 0), ("chassis", 2)):
        bag = StandingBag(tmp_path / f"{body}.bag", Standing(ros2=False, body=body)).write(site)
        command = ["import", str(bag), "--site", "paper_home", "-s", "none", "-o", str(tmp_path / "log.mcap")]
        assert lios([*command, "--force", "--json"]) == code
        told = capsys.readouterr()
        if code == 0:
            assert json.loads(told.out)["mapping"] == "spot_ros2"
        else:
            assert "no tf from map to base_link, no mapped pose topic in that frame (mapping paper)" in told.err
