"""Manipulation on the robot: with its arm through the manipulation service, or by asking a human helper."""

from __future__ import annotations

from math import atan2, cos, hypot, sin
from typing import TYPE_CHECKING, Protocol, final

from bosdyn.api import (
    arm_command_pb2,
    basic_command_pb2,
    geometry_pb2,
    gripper_command_pb2,
    manipulation_api_pb2,
    robot_command_pb2,
    robot_state_pb2,
    synchronized_command_pb2,
)
from bosdyn.client.exceptions import ResponseError
from bosdyn.client.frame_helpers import GRAV_ALIGNED_BODY_FRAME_NAME, GROUND_PLANE_FRAME_NAME, VISION_FRAME_NAME
from bosdyn.client.math_helpers import Quat, SE3Pose
from bosdyn.client.robot_command import RobotCommandBuilder

from recorders.spot.client.connection import reason_of
from recorders.spot.client.frame_trees import tform
from recorders.spot.client.tags import TagSighting
from workbench.tolerances import TINY
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, Container, ContainerId, ItemId

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld

GRASP_LIMIT_S = 60.0
ARM_LIMIT_S = 15.0
ARM_MOVE_S = 2.5
FRESH_S, FIND_S = 1.0, 3.0
"""A grasp aims only at a tag seen within FRESH_S; such a sighting is waited for up to FIND_S."""
ATTEMPTS = 2
AHEAD_M, REACH_M = 0.65, 0.95
"""Distance limits in metres from the body centre to the gripper: far enough to clear the robot's front, and within
reach of the arm, which is 0.98 m from the shoulder (0.3 m ahead of the centre) and less when raised."""
INSET_M, ABOVE_M = 0.15, 0.12
"""Items are placed this many metres from the edge, and released this high above the surface."""
HIGHEST_M, FLOOR_M = 1.1, 0.15
"""Limits in metres of the placing height above the floor (closed furniture is higher than its shelf)."""
BODY_M = 0.52
"""Default height in metres of a standing body."""


class Manipulator(Protocol):
    """Pick and place; each returns the reason of a failure, or ""."""

    def pick(self, item: ItemId) -> str: ...

    def place(self, item: ItemId) -> str: ...


@final
class HelperManipulator:
    """For robots without an arm: a person loads and unloads items and confirms by key."""

    def __init__(self, world: SpotWorld) -> None:
        self._world = world

    def pick(self, item: ItemId) -> str:
        done = self._world.operator.confirm(f"Put {item} on the robot, then press y.")
        return "" if done else f"nobody was there to hand over {item}"

    def place(self, item: ItemId) -> str:
        done = self._world.operator.confirm(f"Take {item} off and put it down here, then press y.")
        return "" if done else f"nobody was there to put down {item}"


@final
class ArmManipulator:
    """Spot's arm: grasps at the position of a tag, and places in front of the body."""

    def __init__(self, world: SpotWorld) -> None:
        self._world = world

    def pick(self, item: ItemId) -> str:
        reason = ""
        for _ in range(ATTEMPTS):
            sighting = self._find(item)
            if sighting is None:
                return f"the tag of {item} is not seen here"
            reason = self._grasp(sighting)
            if not reason:
                self._command(RobotCommandBuilder.arm_carry_command())
                return ""
        self._command(RobotCommandBuilder.arm_stow_command())
        return reason

    def place(self, item: ItemId) -> str:
        if not self._holds():
            return f"the gripper no longer holds {item}"
        x, y, z = self._free_place()
        hand = SE3Pose(x, y, z, Quat.from_yaw(atan2(y, x))).to_proto()
        over = RobotCommandBuilder.arm_pose_command_from_pose(
            hand,
            GRAV_ALIGNED_BODY_FRAME_NAME,
            seconds=ARM_MOVE_S,  # pyright: ignore[reportArgumentType] (an int, by the SDK's default)
        )
        reason = self._command(over)
        if reason:
            self._command(RobotCommandBuilder.arm_carry_command())
            return f"{item} could not be put down: {reason}"
        self._command(RobotCommandBuilder.claw_gripper_open_command())
        if self._holds():
            return f"the gripper did not let go of {item}"
        self._command(RobotCommandBuilder.arm_stow_command())
        return ""

    def _find(self, item: ItemId) -> TagSighting | None:
        """A sighting of the item's tag within the last FRESH_S, of a pose that is sure; None after FIND_S."""
        world = self._world
        end_ns = world.now_ns() + round(FIND_S * 1e9)
        while True:
            for sighting in world.sightings() or ():
                known = world.site.tags.get(sighting.tag)
                fresh = world.now_ns() - sighting.stamp_ns <= round(FRESH_S * 1e9)
                if known is not None and known.id == item and fresh and sighting.reliable:
                    return sighting
            if world.now_ns() > end_ns:
                return None
            world.wait(world.settings.poll_s)

    def _grasp(self, sighting: TagSighting) -> str:
        world, client = self._world, self._world.connection.client("manipulation")
        x, y, z = sighting.in_vision
        request = manipulation_api_pb2.ManipulationApiRequest(
            pick_object=manipulation_api_pb2.PickObject(
                frame_name=VISION_FRAME_NAME, object_rt_frame=geometry_pb2.Vec3(x=x, y=y, z=z)
            )
        )
        try:
            answer: manipulation_api_pb2.ManipulationApiResponse = world.call(
                lambda: client.manipulation_api_command(request, timeout=world.connection.timeout_s)
            )
        except ResponseError as error:
            return f"the grasp was refused ({reason_of(error)})"
        asked = manipulation_api_pb2.ManipulationApiFeedbackRequest(manipulation_cmd_id=answer.manipulation_cmd_id)
        end_ns = world.now_ns() + round(GRASP_LIMIT_S * 1e9)
        state = manipulation_api_pb2.MANIP_STATE_UNKNOWN
        while world.now_ns() < end_ns:
            world.wait(world.settings.poll_s)
            feedback: manipulation_api_pb2.ManipulationApiFeedbackResponse = world.call(
                lambda: client.manipulation_api_feedback_command(asked, timeout=world.connection.timeout_s)
            )
            state = feedback.current_state
            if state == manipulation_api_pb2.MANIP_STATE_GRASP_SUCCEEDED:
                return "" if self._holds() else "the gripper closed on nothing"
            if state in _FAILED:
                break
        name = manipulation_api_pb2.ManipulationFeedbackState.Name(state)
        return f"the grasp ended with {name.removeprefix('MANIP_STATE_').lower()}"

    def _holds(self) -> bool:
        return self._state().manipulator_state.is_gripper_holding_item

    def _free_place(self) -> tuple[float, float, float]:
        """The placing position: above the near edge of the container at hand, in the body frame."""
        world = self._world
        ground = tform(
            self._state().kinematic_state.transforms_snapshot, GRAV_ALIGNED_BODY_FRAME_NAME, GROUND_PLANE_FRAME_NAME
        )
        height_m = BODY_M if ground is None else -ground.z
        body = world.body_pose()
        if body is None or world.at is None or world.at == START:
            return (AHEAD_M, 0.0, FLOOR_M - height_m)
        here = Pose(x_m=body.position.x, y_m=body.position.y, yaw_rad=SE3Pose.from_proto(body).rot.to_yaw())
        return place_on(world.plan.container(ContainerId(world.at)), here, height_m)

    def _state(self) -> robot_state_pb2.RobotState:
        world = self._world
        return world.call(
            lambda: world.connection.client("robot-state").get_robot_state(timeout=world.connection.timeout_s)
        )

    def _command(self, command: robot_command_pb2.RobotCommand) -> str:
        """Execute an arm command and wait for it; returns the reason of a failure, or ""."""
        world, client = self._world, self._world.connection.client("robot-command")
        world.connection.clock.refresh()
        try:
            number: int = world.call(lambda: client.robot_command(command, timeout=world.connection.timeout_s))
        except ResponseError as error:
            return f"the arm refuses ({reason_of(error)})"
        end_ns = world.now_ns() + round(ARM_LIMIT_S * 1e9)
        while world.now_ns() < end_ns:
            world.wait(world.settings.poll_s)
            answer: robot_command_pb2.RobotCommandFeedbackResponse = world.call(
                lambda: client.robot_command_feedback(number, timeout=world.connection.timeout_s)
            )
            ended = command_result(answer.feedback.synchronized_feedback)
            if ended is not None:
                return ended
        return f"the arm did not get there in {ARM_LIMIT_S:g} s"


def place_on(container: Container, here: Pose, height_m: float) -> tuple[float, float, float]:
    """A point above a container's top, INSET_M from its edge and as near to the robot as the arm allows.

    Args:
        here: body pose on the map. height_m: height of the body above the floor.

    Returns:
        Position in metres in the gravity-aligned body frame.
    """
    at, (length, width, tall) = container.pose, container.size_m
    c, s = cos(at.yaw_rad), sin(at.yaw_rad)
    dx, dy = here.x_m - at.x_m, here.y_m - at.y_m
    half = (max(0.0, length / 2 - INSET_M), max(0.0, width / 2 - INSET_M))
    along = max(-half[0], min(half[0], c * dx + s * dy))
    across = max(-half[1], min(half[1], -s * dx + c * dy))
    mx, my = at.x_m + c * along - s * across - here.x_m, at.y_m + s * along + c * across - here.y_m
    c, s = cos(here.yaw_rad), sin(here.yaw_rad)
    x, y = c * mx + s * my, -s * mx + c * my
    away = hypot(x, y) or TINY
    far = max(AHEAD_M, min(REACH_M, away))
    top = min(container.base_m + tall, HIGHEST_M)
    return (x / away * far, y / away * far, max(top, FLOOR_M) + ABOVE_M - height_m)


def command_result(feedback: synchronized_command_pb2.SynchronizedCommand.Feedback) -> str | None:
    """The result of an arm or gripper command: None while running, "" on success, else the reason of the failure."""
    arm, claw = feedback.arm_command_feedback, feedback.gripper_command_feedback.claw_gripper_feedback
    going = basic_command_pb2.RobotCommandFeedbackStatus
    if arm.status not in (going.STATUS_PROCESSING, going.STATUS_UNKNOWN):
        return f"the arm's command ended with {going.Status.Name(arm.status).removeprefix('STATUS_').lower()}"
    named, cartesian = arm_command_pb2.NamedArmPositionsCommand.Feedback, arm_command_pb2.ArmCartesianCommand.Feedback
    match arm.WhichOneof("feedback"):
        case "arm_cartesian_feedback":
            status = arm.arm_cartesian_feedback.status
            if status in (cartesian.STATUS_TRAJECTORY_CANCELLED, cartesian.STATUS_TRAJECTORY_STALLED):
                return "the arm stalled on the way"
            return "" if status == cartesian.STATUS_TRAJECTORY_COMPLETE else None
        case "named_arm_position_feedback":
            status = arm.named_arm_position_feedback.status
            if status == named.STATUS_STALLED_HOLDING_ITEM:
                return "the arm cannot go there while it holds something"
            return "" if status == named.STATUS_COMPLETE else None
        case _:
            claws = gripper_command_pb2.ClawGripperCommand.Feedback
            return "" if claw.status in (claws.STATUS_AT_GOAL, claws.STATUS_APPLYING_FORCE) else None


_FAILED = (
    manipulation_api_pb2.MANIP_STATE_GRASP_FAILED,
    manipulation_api_pb2.MANIP_STATE_GRASP_PLANNING_NO_SOLUTION,
    manipulation_api_pb2.MANIP_STATE_GRASP_FAILED_TO_RAYCAST_INTO_MAP,
    manipulation_api_pb2.MANIP_STATE_GRASP_PLANNING_WAITING_DATA_AT_EDGE,
)
