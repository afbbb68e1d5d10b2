"""The arm: careful ways, grasps that fail, items that are dropped, and stops while something is carried."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import hypot
from typing import Any

import pytest
from bosdyn.api import robot_state_pb2, world_object_pb2
from bosdyn.api.graph_nav import nav_pb2
from spot_help import placed, robot

from recorders.spot.client.connection import Connection
from recorders.spot.client.control import Control
from recorders.spot.client.errors import RunStopped
from recorders.spot.client.time_source import SteppedClock
from recorders.spot.run.arm_motion import grasp_from, hand_to, in_front_of
from recorders.spot.run.operator import AgreeingOperator
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.simulated.faults import FaultKind
from recorders.spot.simulated.services.server import SimulatedSpot
from workbench.worlds.house import ContainerId, ItemId, LocationId
from workbench.worlds.sites.paths import SiteNavigation, other_standing_poses
from workbench.worlds.world import ActionDone, ActionRefused, LookResult

CARRIABLE_AND_STOWABLE = robot_state_pb2.ManipulatorState.CARRY_STATE_CARRIABLE_AND_STOWABLE


@contextmanager
def _at_an_item(
    clock: SteppedClock | None = None, **settings: Any
) -> Iterator[tuple[SimulatedSpot, Connection, SpotWorld, ItemId]]:
    """A robot that stands at an open container with an item in it."""
    with robot(clock=clock) as (spot, connection), Control(connection, own_estop=True) as control:
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        site, house = placed()
        shut = {entry.id for entry in site.file.containers if entry.closed}
        place = next(name for name, items in house.contents.items() if items and name not in shut)
        chosen = RunSettings(**{"poll_s": 0.5, "look_s": 1.0, "stop_within_m": 2.0, **settings})
        world = SpotWorld(connection=connection, control=control, site=site, settings=chosen)
        assert isinstance(world.go_to(LocationId(place)), ActionDone)
        yield spot, connection, world, house.contents[place][0].id


def test_the_arm_goes_by_a_point_in_front_and_back_by_it_within_limits() -> None:
    with _at_an_item() as (spot, _, world, item):
        assert isinstance(world.pick(item), ActionDone)
        assert spot.state.carry_state == CARRIABLE_AND_STOWABLE, "it is not let go of when the connection breaks off"
        assert isinstance(world.place(item), ActionDone)
        assert spot.state.arm_mishaps == []
        assert not spot.state.arm_deployed


def test_hand_commands_have_limits_and_the_point_in_front_is_nearer_and_higher() -> None:
    sent = hand_to((0.9, 0.1, 0.3)).synchronized_command.arm_command
    assert 0 < sent.arm_cartesian_command.max_linear_velocity.value <= 0.5
    assert sent.params.HasField("disable_body_force_limiter")
    assert not sent.params.disable_body_force_limiter.value
    x, y, z = in_front_of((0.9, 0.0, 0.3))
    assert x < 0.9
    assert (y, z) == pytest.approx((0.0, 0.42))
    down = grasp_from((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)).grasp_params.allowable_orientation[0]
    assert down.vector_alignment_with_tolerance.axis_to_align_with_ewrt_frame.z == -1.0


def test_every_arm_command_of_a_pick_and_a_place_has_limits_of_speed_and_force() -> None:
    with _at_an_item() as (_, connection, world, item):
        client, sent = connection.client("robot-command"), list[Any]()
        real = client.robot_command
        client.robot_command = lambda command, **how: (sent.append(command), real(command, **how))[1]
        assert isinstance(world.pick(item), ActionDone)
        assert isinstance(world.place(item), ActionDone)
        client.robot_command = real
    arms = [
        each.synchronized_command.arm_command for each in sent if each.synchronized_command.HasField("arm_command")
    ]
    reaching = [arm for arm in arms if arm.HasField("arm_cartesian_command")]
    assert len(reaching) >= 3, "to the point in front, to the place, and back"
    for arm in reaching:
        assert 0 < arm.arm_cartesian_command.max_linear_velocity.value <= 0.5
        assert 0 < arm.arm_cartesian_command.max_angular_velocity.value <= 1.5
        assert arm.params.HasField("disable_body_force_limiter")
    assert not any(arm.params.disable_body_force_limiter.value for arm in arms)
    claws = [each.synchronized_command.gripper_command.claw_gripper_command for each in sent]
    closing = [claw for claw in claws if claw.HasField("trajectory") and claw.trajectory.points[0].point == 0.0]
    assert len(closing) == 1, "after it let go, on nothing"
    assert 0 < closing[0].maximum_open_close_velocity.value <= 1.0
    assert 0 < closing[0].maximum_torque.value <= 2.0


def test_a_grasp_that_failed_is_tried_from_other_sides() -> None:
    with _at_an_item() as (spot, connection, world, item):
        client, sides = connection.client("manipulation"), list[tuple[float, ...] | None]()
        real = client.manipulation_api_command

        def take(request: Any, **how: Any) -> Any:
            wanted = request.pick_object.grasp_params.allowable_orientation
            along = [one.vector_alignment_with_tolerance.axis_to_align_with_ewrt_frame for one in wanted]
            sides.append((along[0].x, along[0].y, along[0].z) if along else None)
            return real(request, **how)

        client.manipulation_api_command = take
        helper = world.operator = AgreeingOperator()
        spot.state.grasps_miss = 4
        assert isinstance(world.pick(item), ActionDone)
        assert len(helper.asked) == 1
    as_it_likes, above, *elsewhere, level = sides
    assert as_it_likes is None
    assert above == (0.0, 0.0, -1.0)
    assert elsewhere == [None, None], "from two other standing places, before the helper is asked"
    assert level is not None
    assert level[2] == 0.0
    assert hypot(level[0], level[1]) == pytest.approx(1.0)


@pytest.mark.parametrize(("unseen_s", "grasped"), [(0.5, True), (1.5, False)])
def test_a_grasp_aims_only_at_what_was_seen_within_the_last_second(unseen_s: float, grasped: bool) -> None:
    """By the SDK's clock: the robot's own is an hour slow. The robot still lists a tag that it saw seconds ago."""
    with _at_an_item(clock=SteppedClock(skew_s=-3600.0)) as (spot, _, world, item):
        spot.inject(FaultKind.TAG_NOT_SEEN)
        world.wait(unseen_s)
        listed = [
            known.id for seen in world.sightings() or () if (known := world.site.tags.get(seen.tag)) is not None
        ]
        assert item in listed
        answer = world.pick(item)
        assert (spot.state.grasp is not None) is grasped
        assert isinstance(answer, ActionDone) is grasped
    if not grasped:
        assert isinstance(answer, ActionRefused)
        assert "not seen" in answer.reason


def test_grasps_that_fail_are_failed_grasps_and_no_absent_item() -> None:
    with _at_an_item() as (spot, _, world, item):
        told: list[str] = []
        world.tell = told.append
        spot.state.grasps_miss = 9
        answer = world.pick(item)
        assert isinstance(answer, ActionRefused)
        assert answer.item_remains
        assert sum(line.startswith("Grasp ") for line in told) == 4
        helper = AgreeingOperator()
        world.operator, spot.state.grasps_miss = helper, 9
        assert isinstance(world.pick(item), ActionRefused)
        assert "Turn it" in helper.asked[0]


def test_a_grasp_that_fails_from_one_standing_place_is_tried_from_another() -> None:
    """Nobody helps: from where it stands something is in the way, and from the other side the item is in reach."""
    with _at_an_item() as (spot, _, world, item):
        stood = spot.state.no_grasp_from = spot.state.body.pose.point
        container = world.plan.container(ContainerId(str(world.at)))
        ways = world.site.navigation
        assert isinstance(ways, SiteNavigation)
        others = other_standing_poses(ways, world.plan, container, stood)
        assert all(ways.free[ways.grid.cell_at(pose.point)] for pose in others), "no collision by the map"
        assert isinstance(world.pick(item), ActionDone)
        here = spot.state.body.pose.point
        assert hypot(here[0] - stood[0], here[1] - stood[1]) > 0.5
        assert any(hypot(here[0] - pose.x_m, here[1] - pose.y_m) < 0.2 for pose in others)
        assert spot.state.arm_mishaps == [], "it walked there with its arm stowed"
        assert isinstance(world.place(item), ActionDone)


def test_where_there_is_no_way_to_another_standing_place_the_helper_is_asked() -> None:
    with _at_an_item() as (spot, _, world, item):
        spot.state.no_grasp_from = spot.state.body.pose.point
        spot.inject(FaultKind.STUCK)
        answer = world.pick(item)
        assert isinstance(answer, ActionRefused)
        assert answer.item_remains, "it is never lost"


@pytest.mark.parametrize("status", ["STATUS_AMBIGUOUS", "STATUS_HIGH_ERROR"])
def test_an_unsure_pose_is_not_grasped_at_and_the_item_is_not_gone(status: str) -> None:
    with _at_an_item() as (spot, _, world, item):
        spot.state.tag_status = world_object_pb2.AprilTagProperties.AprilTagPoseStatus.Value(status)
        answer = world.pick(item)
        assert isinstance(answer, ActionRefused)
        assert "unsure" in answer.reason
        assert answer.item_remains
        assert spot.state.grasp is None, "no grasp was tried"


def test_an_item_whose_tag_is_not_there_is_gone() -> None:
    with _at_an_item() as (spot, _, world, item):
        spot.inject(FaultKind.TAG_NOT_SEEN)
        world.wait(16.0)
        answer = world.pick(item)
        assert isinstance(answer, ActionRefused)
        assert not answer.item_remains


@pytest.mark.parametrize("helper", [False, True])
def test_a_dropped_item_is_noticed_and_asked_about(helper: bool) -> None:
    with _at_an_item() as (spot, _, world, item):
        assert isinstance(world.pick(item), ActionDone)
        spot.inject(FaultKind.DROPPED_ITEM)
        operator = AgreeingOperator()
        if not helper:
            with pytest.raises(RunStopped, match="was dropped"):
                world.go_to(LocationId("bed"))
            assert spot.state.body.walk is not None
            assert spot.state.body.walk.state != "walking"
            return
        world.operator = operator
        assert isinstance(world.go_to(LocationId("fridge")), ActionDone)
        assert "was dropped" in operator.asked[0]
        assert spot.state.held is not None, "it was taken up again"


@pytest.mark.parametrize("stowable", [True, False])
def test_a_stop_while_carrying_ends_stowed_or_put_down(stowable: bool) -> None:
    with robot() as (spot, connection):
        with Control(connection, own_estop=True) as control:
            connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
            site, house = placed()
            settings = RunSettings(poll_s=0.5, furniture_open=True)
            world = SpotWorld(connection=connection, control=control, site=site, settings=settings)
            place = next(name for name, items in house.contents.items() if items)
            world.go_to(LocationId(place))
            assert isinstance(world.pick(house.contents[place][0].id), ActionDone)
            if not stowable:
                spot.state.carry_state = robot_state_pb2.ManipulatorState.CARRY_STATE_CARRIABLE
            world.stop.press("stopped by key")
        assert spot.state.arm_mishaps == []
        assert (spot.state.held is not None) is stowable
        assert not spot.state.arm_deployed
        assert not spot.state.body.standing
        assert control.returned


def test_the_lease_goes_back_only_after_the_robot_sits() -> None:
    states: list[bool] = []
    with robot() as (spot, connection):
        client = connection.client("lease")
        real = client.return_lease
        client.return_lease = lambda *a, **k: (states.append(spot.state.body.standing), real(*a, **k))[1]
        with Control(connection, own_estop=True):
            pass
        names = [spot.state.commands[number] for number in sorted(spot.state.commands)]
    assert states == [False]
    assert names.index("sit") < names.index("safe-power-off")


def test_closed_furniture_is_reached_into_only_when_somebody_opened_it() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        site, _ = placed()
        closed = next(entry.id for entry in site.file.containers if entry.closed)
        world = SpotWorld(connection=connection, control=control, site=site, settings=RunSettings(look_s=0.5))
        world.at = LocationId(closed)
        answer = world.pick(next(iter(site.tags.values())).id)
        assert isinstance(answer, ActionRefused)
        assert "nobody opened" in answer.reason
        assert answer.item_remains
        assert spot.state.grasp is None
        world.operator = AgreeingOperator()
        looked = world.look_into(ContainerId(closed))
        assert isinstance(looked, LookResult)
        assert looked.opened_by == "operator"
