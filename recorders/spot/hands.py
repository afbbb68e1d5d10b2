"""How does the robot handle things? With its arm through the manipulation service, or by asking a helper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, final

from bosdyn.api import basic_command_pb2, geometry_pb2, gripper_command_pb2, manipulation_api_pb2
from bosdyn.client.exceptions import ResponseError
from bosdyn.client.frame_helpers import VISION_FRAME_NAME
from bosdyn.client.robot_command import RobotCommandBuilder

from recorders.spot.connection import reason_of
from recorders.spot.tags import TagSighting
from workbench.worlds.house import ItemId

if TYPE_CHECKING:
    from recorders.spot.world import SpotWorld

GRASP_LIMIT_S = 60.0
ARM_LIMIT_S = 15.0
ATTEMPTS = 2
PUT_DOWN_M = (0.85, 0.0, 0.25)
"""Where the arm puts things down, in the body frame."""


class Hands(Protocol):
    """Each answers with why it did not work, or nothing."""

    def pick(self, item: ItemId) -> str: ...

    def place(self, item: ItemId) -> str: ...


@final
class HelperHands:
    """No arm: someone puts the thing on the robot and takes it off, and says so by key."""

    def __init__(self, world: SpotWorld) -> None:
        self._world = world

    def pick(self, item: ItemId) -> str:
        done = self._world.operator.confirm(f"Put {item} on the robot, then press y.")
        return "" if done else f"nobody was there to hand over {item}"

    def place(self, item: ItemId) -> str:
        done = self._world.operator.confirm(f"Take {item} off and put it down here, then press y.")
        return "" if done else f"nobody was there to put down {item}"


@final
class ArmHands:
    """Spot's arm: grasps at a tag's place, puts down in front of the body."""

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
        x, y, z = PUT_DOWN_M
        self._command(RobotCommandBuilder.arm_pose_command(x, y, z, 1.0, 0.0, 0.0, 0.0, "body", 2.0))
        self._command(RobotCommandBuilder.claw_gripper_open_command())
        if self._holds():
            return f"the gripper did not let go of {item}"
        self._command(RobotCommandBuilder.arm_stow_command())
        return ""

    def _find(self, item: ItemId) -> TagSighting | None:
        """The item's tag as it is seen now, or as it was last seen."""
        for sighting in self._world.sightings():
            known = self._world.site.tags.get(sighting.tag)
            if known is not None and known.id == item:
                return sighting
        return None

    def _grasp(self, sighting: TagSighting) -> str:
        world, client = self._world, self._world.connection.client("manipulation")
        x, y, z = sighting.in_vision
        request = manipulation_api_pb2.ManipulationApiRequest(
            pick_object=manipulation_api_pb2.PickObject(
                frame_name=VISION_FRAME_NAME, object_rt_frame=geometry_pb2.Vec3(x=x, y=y, z=z)
            )
        )
        try:
            answer = world.call(lambda: client.manipulation_api_command(request, timeout=world.connection.timeout_s))
        except ResponseError as error:
            return f"the grasp was refused ({reason_of(error)})"
        asked = manipulation_api_pb2.ManipulationApiFeedbackRequest(manipulation_cmd_id=answer.manipulation_cmd_id)
        end_ns = world.now_ns() + round(GRASP_LIMIT_S * 1e9)
        state = manipulation_api_pb2.MANIP_STATE_UNKNOWN
        while world.now_ns() < end_ns:
            world.wait(world.settings.poll_s)
            state = world.call(
                lambda: client.manipulation_api_feedback_command(asked, timeout=world.connection.timeout_s)
            ).current_state
            if state == manipulation_api_pb2.MANIP_STATE_GRASP_SUCCEEDED:
                return "" if self._holds() else "the gripper closed on nothing"
            if state in _FAILED:
                break
        name = manipulation_api_pb2.ManipulationFeedbackState.Name(state)
        return f"the grasp ended with {name.removeprefix('MANIP_STATE_').lower()}"

    def _holds(self) -> bool:
        world = self._world
        state = world.call(
            lambda: world.connection.client("robot-state").get_robot_state(timeout=world.connection.timeout_s)
        )
        return bool(state.manipulator_state.is_gripper_holding_item)

    def _command(self, command: Any) -> None:
        """Has the arm do something and waits for it."""
        world, client = self._world, self._world.connection.client("robot-command")
        world.connection.clock.refresh()
        number = world.call(lambda: client.robot_command(command, timeout=world.connection.timeout_s))
        end_ns = world.now_ns() + round(ARM_LIMIT_S * 1e9)
        while world.now_ns() < end_ns:
            world.wait(world.settings.poll_s)
            feedback = world.call(
                lambda: client.robot_command_feedback(number, timeout=world.connection.timeout_s)
            ).feedback
            if _is_done(feedback.synchronized_feedback):
                return


def _is_done(feedback: Any) -> bool:
    """Whether arm and gripper have arrived."""
    arm, claw = feedback.arm_command_feedback, feedback.gripper_command_feedback.claw_gripper_feedback
    if arm.status not in (basic_command_pb2.RobotCommandFeedbackStatus.STATUS_PROCESSING, 0):
        return True
    there = (
        arm.arm_cartesian_feedback.status == 1
        or arm.named_arm_position_feedback.status == 1
        or arm.arm_joint_move_feedback.status == 1
    )
    at_goal = claw.status in (
        gripper_command_pb2.ClawGripperCommand.Feedback.STATUS_AT_GOAL,
        gripper_command_pb2.ClawGripperCommand.Feedback.STATUS_APPLYING_FORCE,
    )
    named = arm.WhichOneof("feedback")
    return there or (named is None and at_goal)


_FAILED = (
    manipulation_api_pb2.MANIP_STATE_GRASP_FAILED,
    manipulation_api_pb2.MANIP_STATE_GRASP_PLANNING_NO_SOLUTION,
    manipulation_api_pb2.MANIP_STATE_GRASP_FAILED_TO_RAYCAST_INTO_MAP,
    manipulation_api_pb2.MANIP_STATE_GRASP_PLANNING_WAITING_DATA_AT_EDGE,
)
