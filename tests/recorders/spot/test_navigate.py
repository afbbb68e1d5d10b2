"""Every way in which a walk may end, and what the run does then."""

from __future__ import annotations

from pathlib import Path

import pytest
from bosdyn.api.graph_nav import graph_nav_pb2, nav_pb2
from bosdyn.client.exceptions import UnableToConnectToRobotError
from spot_help import placed, robot, run_of

from recorders.spot.client.connection import Connection
from recorders.spot.client.control import Control
from recorders.spot.client.errors import RunStopped
from recorders.spot.run.navigate import ENDINGS, WalkEnding, navigation_goal, renew_navigation
from recorders.spot.run.operator import AgreeingOperator, StopSwitch
from recorders.spot.run.run import run_and_record
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.simulated.faults import FaultKind
from replayers.runs.run import read
from workbench.errors import BadValue
from workbench.worlds.house import LocationId
from workbench.worlds.world import ActionDone, ActionRefused

BED = LocationId("bed")
STATUSES = graph_nav_pb2.NavigationFeedbackResponse.Status


def _world(connection: Connection, control: Control, **settings: object) -> SpotWorld:
    connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
    chosen = RunSettings(**{"poll_s": 0.5, **settings})  # type: ignore[arg-type]
    return SpotWorld(connection=connection, control=control, site=placed()[0], settings=chosen)


def test_every_status_of_the_protocol_has_an_end() -> None:
    assert set(ENDINGS) == set(STATUSES.values())


@pytest.fixture(scope="module")
def standing() -> object:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        yield spot, connection, control


@pytest.mark.parametrize("status", [number for number in STATUSES.values() if number not in (1, 2, 7)])
def test_a_walk_that_does_not_arrive_leaves_the_robot_stopped(status: int, standing: object) -> None:
    spot, connection, control = standing  # type: ignore[misc]
    world = _world(connection, control)
    told: list[str] = []
    world.tell = told.append
    stops: list[str] = []
    real, control.stop = control.stop, lambda: (stops.append("stop"), real())[0]
    spot.state.navigation_status = status
    sent = spot.state.next_command
    try:
        if ENDINGS[status] is WalkEnding.STOPS_RUN:
            with pytest.raises(RunStopped):
                world.go_to(BED)
        else:
            assert isinstance(world.go_to(BED), ActionRefused)
            assert any("On the way to bed" in line for line in told)
    finally:
        spot.state.navigation_status, control.stop = None, real
    assert stops, "not left to the robot's timeout"
    if ENDINGS[status] in (WalkEnding.REFUSED, WalkEnding.STOPS_RUN):
        assert spot.state.next_command - sent <= 2, "one walk and one stop: it is not sent off again"


def test_a_status_that_this_client_does_not_know_ends_the_walk(standing: object) -> None:
    spot, connection, control = standing  # type: ignore[misc]
    world = _world(connection, control)
    spot.state.navigation_status = 999
    try:
        answer = world.go_to(BED)
    finally:
        spot.state.navigation_status = None
    assert isinstance(answer, ActionRefused)
    assert "does not know (999)" in answer.reason


def test_a_lost_robot_that_sees_no_fiducial_does_not_walk_on(standing: object) -> None:
    spot, connection, control = standing  # type: ignore[misc]
    world = _world(connection, control, retry_s=0.5)
    spot.inject(FaultKind.LOST_LOCALIZATION)
    spot.state.fiducials_from_floor, spot.state.body.standing = False, False
    sent = spot.state.next_command
    answer = world.go_to(BED)
    spot.state.body.standing = True
    assert isinstance(answer, ActionRefused)
    assert "does not know where it is" in answer.reason
    assert spot.state.next_command == sent, "no command was sent to a lost robot"


@pytest.mark.parametrize("way", ["nobody", "resume", "operator"])
def test_after_an_outage_the_robot_goes_on_only_if_it_may(way: str, standing: object) -> None:
    _, connection, control = standing  # type: ignore[misc]
    world = _world(connection, control, resume=way == "resume")
    if way == "operator":
        world.operator = AgreeingOperator()
    calls: list[int] = []

    def away() -> str:
        calls.append(1)
        if len(calls) < 12:
            raise UnableToConnectToRobotError(Exception("no route"))
        return "here"

    if way == "nobody":
        with pytest.raises(RunStopped, match="--resume"):
            world.call(away)
    else:
        assert world.call(away) == "here"
    calls[:] = [1] * 9
    assert world.call(away) == "here", "1 s: its command was still valid, and it did not stop"


def test_a_walk_whose_command_ran_out_is_not_sent_again_by_itself(standing: object) -> None:
    _, connection, control = standing  # type: ignore[misc]
    world = _world(connection, control)
    fridge = LocationId("fridge")
    pose = world.site.paths.standing_pose(fridge)
    assert pose is not None
    goal = navigation_goal(world, fridge, pose)
    number = renew_navigation(world, goal, None)
    connection.clock.sleep(4.0)
    with pytest.raises(RunStopped, match="--resume"):
        renew_navigation(world, goal, number)


def test_the_log_says_where_by_which_tag_and_how_long_ago_the_robot_was_localised(tmp_path: Path) -> None:
    stop = StopSwitch()
    stop.press("enough")
    with robot() as (spot, connection):
        spot.state.fiducials = {523: (spot.state.site.plan.start.x_m + 0.5, spot.state.site.plan.start.y_m, 0.6)}
        run_and_record(connection, run_of(spot, "pes-greedy"), tmp_path / "run.mcap", stop=stop)
    told = read(tmp_path / "run.mcap").settings["spot"]["localization"]
    assert told["tag"] == 523
    assert told["waypoint"].startswith("wp-")
    assert 0 <= told["age_s"] < 1


def _with_hiccup(world: SpotWorld, connection: Connection, hiccup_s: float) -> None:
    """Let the fifth feedback of a walk arrive late."""
    client = connection.client("graph-nav-service")
    real, asked = client.navigation_feedback, list[int]()

    def late(*about: object, **how: object) -> object:
        asked.append(1)
        if len(asked) == 5:
            connection.clock.sleep(hiccup_s)
        return real(*about, **how)

    client.navigation_feedback = late
    try:
        answer = world.go_to(BED)
    finally:
        client.navigation_feedback = real
    assert isinstance(answer, ActionDone)
    assert len(asked) > 5


def test_a_hiccup_of_half_a_second_does_not_stop_a_walk_and_a_longer_one_does() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        world = _world(connection, control, poll_s=0.25)
        sent = spot.state.next_command
        _with_hiccup(world, connection, 0.5)
        assert spot.state.next_command == sent + 1, "one command, renewed and never begun anew"
        assert isinstance(world.go_to(LocationId("fridge")), ActionDone)
        with pytest.raises(RunStopped, match="--resume"):
            _with_hiccup(world, connection, 1.2)


@pytest.mark.parametrize(
    ("stop_within_m", "speed_mps", "hold_s"), [(0.5, 0.5, 0.9), (1.0, 0.5, 1.8), (0.5, 0.25, 1.8), (0.5, 0.1, 3.0)]
)
def test_a_command_holds_for_as_long_as_the_robot_may_walk_on(
    stop_within_m: float, speed_mps: float, hold_s: float
) -> None:
    settings = RunSettings(stop_within_m=stop_within_m)
    assert settings.hold_s(speed_mps) == pytest.approx(hold_s)
    assert speed_mps * settings.hold_s(speed_mps) < stop_within_m
    settings.check_hold(speed_mps)


def test_a_robot_too_fast_to_stop_within_the_limit_is_not_sent_off() -> None:
    with pytest.raises(BadValue, match=r"at least 0\.67 m at 1 m/s; or limit the speed to 0\.75 m/s"):
        RunSettings().check_hold(1.0)
