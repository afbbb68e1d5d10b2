"""Runs on the robot: the closed loop through the official client, with every failure on the way.

In every case the log is complete, the run ends with a status, and the lease is free.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from spot_help import FEW, home, is_free, messages, placed, robot, run_of

from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.operator import AgreeingOperator, StopSwitch
from recorders.spot.run.run import RobotRun, RunReport, first_decision, run_and_record
from recorders.spot.run.run_settings import RunSettings
from replayers.runs.run import Run, read
from workbench.execution.events import Event
from workbench.log_schema.tags_in_passing_json import tags_from_settings
from workbench.planning.tasks import AllOf, Delivered, Task
from workbench.worlds.house import LocationId
from workbench.worlds.sight.sightings import stop_point


def whole(path: Path) -> Run:
    """The run of a log that was closed and whose every chunk is sound."""
    assert messages(path)
    run = read(path, with_truth=True)
    assert run.complete
    assert run.outcome is not None
    return run


def test_the_papers_delivery_from_log_in_to_lease_returned(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    with robot() as (spot, connection):
        report = run_and_record(connection, run_of(spot, stop_within_m=0.5), log)
        assert report.ended.status == "done", report.ended.reason
        assert report.lease_returned
        assert spot.state.leases.owner is None
        where = {thing.tag: thing.container for thing in spot.state.things}
        assert where == {101: "countertop", 102: "bed"}
        assert spot.state.body.motors == "off"
    run = whole(log)
    assert run.info.source == "spot"
    assert run.info.inertial_frame == "odom"
    assert run.outcome is not None
    assert run.outcome.searches == len(run.observations) == report.ended.searches
    topics = {topic for topic, *_ in messages(log)}
    assert {
        "/tf",
        "/robot/pose",
        "/robot/odometry",
        "/spot/robot_state",
        "/camera/frontleft_fisheye",
        "/map",
    } <= topics
    moved = [a for a in run.actions if a.action == "move"]
    tags = tags_from_settings(run.settings, run.place)
    assert tags is not None
    stops = [a.origin if stop_point(a.target) is None else a.target for a in moved]
    planned = [
        tags.travel_from(LocationId(stop)).between(LocationId(a.origin), LocationId(a.target))
        for stop, a in zip(stops, moved, strict=True)
    ]
    assert [a.travel_m for a in moved] == pytest.approx(planned, abs=0.8)


@pytest.mark.ci
def test_the_same_seed_gives_the_same_run(tmp_path: Path) -> None:
    told: list[list[object]] = []
    for number in range(2):
        with robot() as (spot, connection):
            run_and_record(connection, run_of(spot), tmp_path / f"{number}.mcap")
        run = read(tmp_path / f"{number}.mcap")
        told.append([*run.observations, *run.actions, run.outcome])
    assert told[0] == told[1]


@pytest.mark.ci
def test_a_robot_that_starts_elsewhere_starts_from_there(tmp_path: Path) -> None:
    """The survey says (10, 2.4); configuration D puts the robot at (6, 2.4)."""
    with robot(configuration="D") as (spot, connection):
        survey = replace(run_of(spot), site=home())
        run_and_record(connection, survey, tmp_path / "run.mcap")
    place = read(tmp_path / "run.mcap").place
    assert place.plan.start.x_m == pytest.approx(6.0, abs=0.1)


FAULTS = {
    "lost-lease@20": ("aborted", "lease was lost"),
    "stuck@20+8": ("done", ""),
    "estop@20": ("aborted", "impaired"),
    "lost-localization@20": ("done", ""),
    "stuck@20": (None, "stuck"),
    "tag-not-seen@0": ("nothing-left-to-search", ""),
    "clock-skew@20+4": ("done", ""),
}


@pytest.mark.ci_but(3)
@pytest.mark.parametrize("fault", FAULTS)
def test_failures_during_a_run(fault: str, tmp_path: Path) -> None:
    status, reason = FAULTS[fault]
    with robot(fault) as (spot, connection):
        report = run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert is_free(spot)
        assert report.lease_returned
    assert status is None or report.ended.status == status, report.ended.reason
    run = whole(tmp_path / "run.mcap")
    assert run.outcome is not None
    assert run.outcome.status == report.ended.status
    told = " ".join([report.ended.reason, *(a.reason for a in run.actions)])
    assert reason in told


@pytest.mark.ci
@pytest.mark.parametrize(("away_s", "status"), [(1.0, "done"), pytest.param(60.0, "aborted", marks=pytest.mark.slow)])
def test_a_network_that_goes_away(away_s: float, status: str, tmp_path: Path) -> None:
    """Short: the run goes on. Long: it ends, the log is whole; the lease cannot be returned while nobody hears it."""
    heard = 0

    def hear(event: Event) -> None:
        nonlocal heard
        heard += 1
        if heard == 4:
            spot.drop(away_s)

    with robot(clock=RunningClock(speed_up=15)) as (spot, connection):
        run = replace(
            run_of(spot, patience_s=2.0, look_s=0.4, poll_s=0.05, resume=True), rates=replace(FEW, state_hz=5)
        )
        if status == "aborted":
            import recorders.spot.client.control as control

            control.GIVE_BACK_S, kept = 1.0, control.GIVE_BACK_S
            try:
                report = run_and_record(connection, run, tmp_path / "run.mcap", on_event=hear)
            finally:
                control.GIVE_BACK_S = kept
            assert "did not answer" in report.ended.reason
            assert not report.lease_returned
        else:
            report = run_and_record(connection, run, tmp_path / "run.mcap", on_event=hear)
            assert report.gaps, "the gap is marked"
            assert is_free(spot)
    assert report.ended.status == status, report.ended.reason
    whole(tmp_path / "run.mcap")


def test_the_stop_key_ends_the_run_and_stops_the_robot(tmp_path: Path) -> None:
    stop, steps = StopSwitch(), 0

    def hear(event: Event) -> None:
        nonlocal steps
        steps += 1
        if steps == 4:
            stop.press("stopped by key")

    with robot() as (spot, connection):
        report = run_and_record(connection, run_of(spot), tmp_path / "run.mcap", stop=stop, on_event=hear)
        assert report.ended.status == "aborted"
        assert report.ended.reason == "stopped by key"
        assert spot.state.leases.owner is None
        assert spot.state.body.walk is not None
        assert spot.state.body.walk.state != "walking"
    whole(tmp_path / "run.mcap")


def test_a_planner_that_raises_does_not_keep_the_lease(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> object:
        raise ZeroDivisionError("a bug in somebody's planner")

    monkeypatch.setattr("workbench.execution.setup.run_task", broken)
    with robot() as (spot, connection):
        with pytest.raises(ZeroDivisionError):
            run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert spot.state.leases.owner is None
    assert messages(tmp_path / "run.mcap")


@pytest.mark.ci
def test_without_an_arm_a_helper_hands_things_over(tmp_path: Path) -> None:
    """Without tags in passing, by which it would not open the fridge."""
    site, _ = placed()
    armless = replace(site, robot=replace(site.robot, arm=False))
    helper = AgreeingOperator()
    with robot(site=armless) as (spot, connection):
        report = run_and_record(
            connection, run_of(spot, furniture_open=False, sees_m=0), tmp_path / "run.mcap", operator=helper
        )
    assert report.ended.status == "done", report.ended.reason
    assert any("Put CellPhone|1 on the robot" in asked for asked in helper.asked)
    assert any("Open fridge" in asked for asked in helper.asked)


@pytest.mark.slow
def test_without_an_arm_and_a_helper_nothing_is_picked(tmp_path: Path) -> None:
    site, _ = placed()
    armless = replace(site, robot=replace(site.robot, arm=False))
    with robot(site=armless) as (spot, connection):
        report = run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert is_free(spot)
    assert report.ended.status != "done"
    assert "nobody was there" in " ".join(a.reason for a in whole(tmp_path / "run.mcap").actions)


@pytest.mark.ci
def test_a_site_without_waypoints_goes_to_map_poses(tmp_path: Path) -> None:
    site, _ = placed()
    with robot() as (spot, connection):
        run = replace(run_of(spot), site=replace(site, waypoints={}))
        report = run_and_record(connection, run, tmp_path / "run.mcap")
    assert report.ended.status == "done", report.ended.reason


def test_a_map_that_is_turned_against_the_robots_own(tmp_path: Path) -> None:
    """The site's map is the robot's seed frame moved by (3, -1) and turned by 90 degrees: the same metres."""
    from math import pi

    from recorders.spot.client.seed_frame import in_seed, on_map
    from workbench.worlds.geometry import Pose

    site = replace(placed()[0], seed=Pose(x_m=3.0, y_m=-1.0, yaw_rad=pi / 2))
    goal = in_seed(site, Pose(x_m=3.0, y_m=1.0, yaw_rad=pi / 2))
    assert (goal.position.x, goal.position.y) == pytest.approx((2.0, 0.0))
    back = on_map(site, goal)
    assert (back.position.x, back.position.y) == pytest.approx((3.0, 1.0))


def test_waypoints_that_the_robot_does_not_know_are_named_before_anything_moves(tmp_path: Path) -> None:
    from recorders.spot.client.errors import WaypointMissing

    site, _ = placed()
    wrong = replace(site, waypoints={**site.waypoints, "bed": "wp-attic"})  # type: ignore[dict-item]
    with robot() as (spot, connection):
        with pytest.raises(WaypointMissing, match="wp-attic"):
            run_and_record(connection, replace(run_of(spot), site=wrong), tmp_path / "run.mcap")
        assert spot.state.leases.number == 0, "no lease was taken"
    assert not (tmp_path / "run.mcap").exists()


def test_a_dry_run_plans_and_moves_nothing() -> None:
    with robot() as (spot, connection):
        planned = first_decision(connection, run_of(spot))
        assert planned is not None
        assert planned.made.plan.steps
        assert spot.state.leases.number == 0
        assert spot.state.body.walked_m == 0


@pytest.mark.slow
def test_the_speed_limit_is_kept(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        slow = run_and_record(connection, run_of(spot, speed_mps=0.25), tmp_path / "slow.mcap")
    with robot() as (spot, connection):
        usual = run_and_record(connection, run_of(spot), tmp_path / "usual.mcap")
    walked = slow.ended.travel_m
    assert slow.seconds - usual.seconds == pytest.approx(walked / 0.25 - walked / 0.5, rel=0.15)


def test_preparing_asks_a_helper() -> None:
    from recorders.spot.client.control import Control
    from recorders.spot.run.world import SpotWorld
    from workbench.worlds.world import ActionDone, ActionRefused

    with robot() as (_spot, connection):
        world = SpotWorld(connection=connection, control=Control(connection), site=placed()[0])
        assert isinstance(world.prepare("boil", ()), ActionRefused)
        world = SpotWorld(
            connection=connection, control=Control(connection), site=placed()[0], operator=AgreeingOperator()
        )
        assert isinstance(world.prepare("boil", ()), ActionDone)


def test_a_run_in_real_time_is_recorded_from_several_threads(tmp_path: Path) -> None:
    with robot(clock=RunningClock(speed_up=15)) as (spot, connection):
        run = replace(
            run_of(spot, look_s=0.3, poll_s=0.04, resume=True), rates=replace(FEW, state_hz=10, images_hz=2)
        )
        report = run_and_record(connection, run, tmp_path / "run.mcap")
    assert report.ended.status == "done", report.ended.reason
    run_read = whole(tmp_path / "run.mcap")
    times = [log_time for _, log_time, _, _ in messages(tmp_path / "run.mcap", "/spot/robot_state")]
    assert times == sorted(times)
    assert len(run_read.observations) == report.ended.searches


@pytest.mark.slow
def test_a_task_over_one_item(tmp_path: Path) -> None:
    task = Task(
        scenario="bring-phone",
        goal=AllOf(parts=(Delivered(item_type="CellPhone", at="couch"),)),  # type: ignore[arg-type]
        failure_cost=100.0,
        budget_s=60.0,
    )
    with robot() as (spot, connection):
        run: RobotRun = replace(run_of(spot), task=task, settings=RunSettings(look_s=2.0))
        report: RunReport = run_and_record(connection, run, tmp_path / "run.mcap")
    assert report.ended.status == "done"
