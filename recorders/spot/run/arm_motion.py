"""Commands to Spot's arm: where its hand goes, how fast, and how a command ended."""

from __future__ import annotations

from math import atan2, cos, hypot, sin

from bosdyn.api import (
    arm_command_pb2,
    geometry_pb2,
    gripper_command_pb2,
    manipulation_api_pb2,
    robot_command_pb2,
    synchronized_command_pb2,
)
from bosdyn.client.frame_helpers import GRAV_ALIGNED_BODY_FRAME_NAME, VISION_FRAME_NAME
from bosdyn.client.math_helpers import Quat, SE3Pose
from bosdyn.client.robot_command import RobotCommandBuilder

from recorders.spot.client.command_status import command_end
from workbench.message_enum import MessageEnum, Result
from workbench.tolerances import TINY
from workbench.worlds.geometry import Pose
from workbench.worlds.house import Container

Position = tuple[float, float, float]
ARM_MOVE_S = 2.5
HAND_MPS, HAND_RADPS = 0.5, 1.5
"""Speed limits of the hand in metres and radians per second."""
CLAW_RADPS, CLAW_NM = 1.0, 2.0
"""Limits of the gripper where it closes on nothing, in radians per second and newton metres: for fingers in it."""
AHEAD_M, REACH_M = 0.65, 0.95
"""Distance limits in metres from the body centre to the gripper: far enough to clear the robot's front, and within
reach of the arm, which is 0.98 m from the shoulder (0.3 m ahead of the centre) and less when raised."""
BEFORE_M, RAISED_M = 0.55, 0.12
"""The point in front of a goal: this far from the body centre, and this much higher than the goal, in metres."""
INSET_M, ABOVE_M = 0.15, 0.12
"""Items are placed this many metres from the edge, and released this high above the surface."""
MAX_HEIGHT_M, FLOOR_M = 1.1, 0.15
"""Limits in metres of the placing height above the floor (closed furniture is higher than its shelf)."""
GRASP_TOLERANCE_RAD = 0.35
"""Tolerance of a prescribed direction of a grasp."""


class ArmOutcome(MessageEnum):
    """How a command to the arm or the gripper ended; RUNNING until then."""

    DONE = ""
    RUNNING = "the arm is on its way"
    ENDED = "the arm's command ended with {status}"
    STALLED = "the arm stalled on the way"
    STALLED_HOLDING = "the arm cannot go there while it holds something"
    REFUSED = "the arm refuses ({reason})"
    LATE = "the arm did not get there in {limit_s} s"
    STILL_HOLDS = "the gripper did not let go"


def hand_to(position: Position) -> robot_command_pb2.RobotCommand:
    """The command that moves the hand to a position in the gravity-aligned body frame, within the speed limits and
    with the robot's own force limiter on."""
    x, y, z = position
    command = RobotCommandBuilder.arm_pose_command_from_pose(
        SE3Pose(x, y, z, Quat.from_yaw(atan2(y, x))).to_proto(),
        GRAV_ALIGNED_BODY_FRAME_NAME,
        seconds=ARM_MOVE_S,  # pyright: ignore[reportArgumentType] (an int, by the SDK's default)
    )
    arm = command.synchronized_command.arm_command
    arm.arm_cartesian_command.max_linear_velocity.value = HAND_MPS
    arm.arm_cartesian_command.max_angular_velocity.value = HAND_RADPS
    arm.params.disable_body_force_limiter.value = False
    return command


def close_gripper() -> robot_command_pb2.RobotCommand:
    """The command that closes the empty gripper, slowly and with little force."""
    command = RobotCommandBuilder.claw_gripper_close_command()
    claw = command.synchronized_command.gripper_command.claw_gripper_command
    claw.maximum_open_close_velocity.value = CLAW_RADPS
    claw.maximum_torque.value = CLAW_NM
    return command


def in_front_of(position: Position) -> Position:
    """The point from which the hand goes to a position, and to which it returns: nearer to the body, and higher."""
    x, y, z = position
    away = hypot(x, y) or TINY
    return (x / away * BEFORE_M, y / away * BEFORE_M, z + RAISED_M)


def grasp_from(at: Position, direction: Position | None) -> manipulation_api_pb2.PickObject:
    """A grasp at a position in the vision frame, its palm facing along a direction; None lets the robot choose."""
    pick = manipulation_api_pb2.PickObject(
        frame_name=VISION_FRAME_NAME, object_rt_frame=geometry_pb2.Vec3(x=at[0], y=at[1], z=at[2])
    )
    if direction is not None:
        pick.grasp_params.grasp_params_frame_name = VISION_FRAME_NAME
        aligned = pick.grasp_params.allowable_orientation.add().vector_alignment_with_tolerance
        aligned.axis_on_gripper_ewrt_gripper.x = 1.0
        wanted = aligned.axis_to_align_with_ewrt_frame
        wanted.x, wanted.y, wanted.z = direction
        aligned.threshold_radians = GRASP_TOLERANCE_RAD
    return pick


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
    top = min(container.base_m + tall, MAX_HEIGHT_M)
    return (x / away * far, y / away * far, max(top, FLOOR_M) + ABOVE_M - height_m)


def command_result(feedback: synchronized_command_pb2.SynchronizedCommand.Feedback) -> Result[ArmOutcome]:
    """The outcome of an arm or gripper command, RUNNING if it has not ended."""
    arm, claw = feedback.arm_command_feedback, feedback.gripper_command_feedback.claw_gripper_feedback
    status = command_end(arm.status)
    if status is not None:
        return ArmOutcome.ENDED.result(status=status)
    named, cartesian = arm_command_pb2.NamedArmPositionsCommand.Feedback, arm_command_pb2.ArmCartesianCommand.Feedback
    match arm.WhichOneof("feedback"):
        case "arm_cartesian_feedback":
            status = arm.arm_cartesian_feedback.status
            if status in (cartesian.STATUS_TRAJECTORY_CANCELLED, cartesian.STATUS_TRAJECTORY_STALLED):
                return ArmOutcome.STALLED.result()
            done = status == cartesian.STATUS_TRAJECTORY_COMPLETE
        case "named_arm_position_feedback":
            status = arm.named_arm_position_feedback.status
            if status == named.STATUS_STALLED_HOLDING_ITEM:
                return ArmOutcome.STALLED_HOLDING.result()
            done = status == named.STATUS_COMPLETE
        case _:
            claws = gripper_command_pb2.ClawGripperCommand.Feedback
            done = claw.status in (claws.STATUS_AT_GOAL, claws.STATUS_APPLYING_FORCE)
    return ArmOutcome.DONE.result() if done else ArmOutcome.RUNNING.result()
