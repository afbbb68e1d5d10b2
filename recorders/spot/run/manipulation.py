"""Manipulation on the robot: with its arm through the manipulation service, or by asking a human helper."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import hypot
from typing import TYPE_CHECKING, Protocol, final

from bosdyn.api import manipulation_api_pb2, robot_command_pb2, robot_state_pb2
from bosdyn.client.exceptions import ResponseError
from bosdyn.client.frame_helpers import (
    BODY_FRAME_NAME,
    GRAV_ALIGNED_BODY_FRAME_NAME,
    GROUND_PLANE_FRAME_NAME,
    VISION_FRAME_NAME,
)
from bosdyn.client.math_helpers import SE3Pose
from bosdyn.client.robot_command import RobotCommandBuilder

from recorders.spot.client.connection import ROBOT_ERRORS, reason_of
from recorders.spot.client.errors import RunStopped
from recorders.spot.client.frame_trees import tform
from recorders.spot.client.odometer import WalkLog
from recorders.spot.run.arm_motion import (
    AHEAD_M,
    FLOOR_M,
    ArmOutcome,
    Position,
    close_gripper,
    command_result,
    grasp_from,
    hand_to,
    in_front_of,
    place_on,
)
from recorders.spot.run.navigate import WalkEnding, walk
from recorders.spot.tags.detections import TagSighting
from workbench.errors import LiosError
from workbench.message_enum import MessageEnum, Result
from workbench.tolerances import TINY
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, ContainerId, ItemId, LocationId
from workbench.worlds.sight.sightings import stop_point
from workbench.worlds.sites.paths import SiteNavigation, other_standing_poses

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld

GRASP_LIMIT_S = 60.0
ARM_LIMIT_S = 15.0
FRESH_S, FIND_S = 1.0, 3.0
"""A grasp aims only at a tag seen within FRESH_S; such a sighting is waited for up to FIND_S."""
BODY_M = 0.52
"""Default height in metres of a standing body."""
AT_HAND_M = 1.0
"""A robot that is farther than this from where it stands at a container is not at it."""
DOWN = (0.0, 0.0, -1.0)
Side = Callable[[TagSighting], Position | None]
"""The direction of a grasp at a tag; None lets the robot choose."""


class Handling(MessageEnum):
    """How picking, placing or preparing ended."""

    DONE = ""
    NO_HELPER = "nobody was there to {action}"
    NOT_OPENED = "nobody opened {container}"
    NOT_SEEN = "the tag of {item} is not seen here"
    POSE_UNSURE = "the pose of the tag of {item} is unsure (ambiguous, or of high error)"
    GRASP_REFUSED = "the grasp was refused ({reason})"
    GRASP_FAILED = "the grasp ended with {state}"
    GRASP_EMPTY = "the gripper closed on nothing"
    DROPPED = "the gripper no longer holds {item}"
    NOT_PUT_DOWN = "{item} could not be put down: {reason}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Picked:
    """How a pick ended; `item_remains` says that it failed with the item still there."""

    result: Result[Handling]
    item_remains: bool = False


class Manipulator(Protocol):
    """Picks and places."""

    def pick(self, item: ItemId) -> Picked: ...

    def place(self, item: ItemId) -> Result[Handling]: ...

    def check_holding(self) -> bool:
        """Whether what is carried had been dropped, for which the robot was stopped; it is held again.

        Raises:
            RunStopped: it was dropped, and is not held again.
        """
        ...


@final
class HelperManipulator:
    """For robots without an arm: a person loads and unloads items and confirms by key."""

    def __init__(self, world: SpotWorld) -> None:
        self._world = world

    def pick(self, item: ItemId) -> Picked:
        done = self._world.operator.confirm(f"Put {item} on the robot, then press y.")
        if done:
            return Picked(result=Handling.DONE.result())
        return Picked(result=Handling.NO_HELPER.result(action=f"hand over {item}"), item_remains=True)

    def place(self, item: ItemId) -> Result[Handling]:
        done = self._world.operator.confirm(f"Take {item} off and put it down here, then press y.")
        return Handling.DONE.result() if done else Handling.NO_HELPER.result(action=f"put down {item}")

    def check_holding(self) -> bool:
        return False


@final
class ArmManipulator:
    """Spot's arm: grasps at the position of a tag, and places in front of the body."""

    def __init__(self, world: SpotWorld) -> None:
        self._world = world
        self._carrying: ItemId | None = None
        world.control.before_rest = self.secure

    def pick(self, item: ItemId) -> Picked:
        """Grasp an item as the robot likes, then from above, then from other standing places, then after a helper
        turned it, from the robot's side."""
        grasps, result, there = 0, Handling.NOT_SEEN.result(item=item), item in self._world.shown_by_operator
        for ready, side in self._tries(item):
            if not ready(result.message):
                continue
            sighting = self._find(item)
            if isinstance(sighting, Result):
                if sighting.kind is Handling.POSE_UNSURE:
                    result, there = sighting, True
                if not there:
                    break
                continue
            grasps, there = grasps + 1, True
            result = self._grasp(sighting, side(sighting))
            if result.kind is Handling.DONE:
                self._carry(item)
                return Picked(result=result)
            self._world.tell(f"Grasp {grasps} of {item} failed: {result.message}")
        self._command(RobotCommandBuilder.arm_stow_command())
        return Picked(result=result, item_remains=there)

    def _tries(self, item: ItemId) -> Iterator[tuple[Callable[[str], bool], Side]]:
        """What is to be done before each attempt to grasp an item, given why the last one failed, and the side from
        which it is grasped then."""
        yield (lambda _: True), (lambda _: None)
        yield (lambda _: True), (lambda _: DOWN)
        for pose in self._other_stands():
            yield partial(self._stands_at, pose), (lambda _: None)
        yield partial(self._turned, item), self._from_the_robot

    def _other_stands(self) -> tuple[Pose, ...]:
        """Other poses at the container at which the robot stands, collision-free by the map; none without one."""
        world, navigation = self._world, self._world.site.navigation
        body = world.body_pose()
        stand = None if world.at in (None, START) else world.site.paths.standing_pose(LocationId(str(world.at)))
        if body is None or stand is None or not isinstance(navigation, SiteNavigation):
            return ()
        here = (body.position.x, body.position.y)
        if hypot(here[0] - stand.x_m, here[1] - stand.y_m) > AT_HAND_M:
            return ()
        return other_standing_poses(navigation, world.plan, world.plan.container(ContainerId(str(world.at))), here)

    def _stands_at(self, pose: Pose, reason: str) -> bool:
        """Whether the robot went to another pose at the container at hand, its arm stowed."""
        world = self._world
        world.tell(f"Tried from another standing place: {reason}")
        self._command(RobotCommandBuilder.arm_stow_command())
        ended = walk(world, LocationId(str(world.at)), WalkLog(), stand=pose)
        if ended.ending is not WalkEnding.ARRIVED:
            world.tell(f"On the way to another standing place: {ended.reason}")
        return ended.ending is WalkEnding.ARRIVED

    def place(self, item: ItemId) -> Result[Handling]:
        if not self._holds():
            self._carrying = None
            return Handling.DROPPED.result(item=item)
        self._carrying = None
        ended = self._put_down(self._free_place())
        if ended.kind is not ArmOutcome.DONE:
            self._carrying = item
            self._command(RobotCommandBuilder.arm_carry_command())
            return Handling.NOT_PUT_DOWN.result(item=item, reason=ended.message)
        return Handling.DONE.result()

    def check_holding(self) -> bool:
        item = self._carrying
        if item is None or self._holds() or self._holds():
            return False
        self._carrying = None
        world = self._world
        world.control.stop()
        world.tell(f"{item} was dropped")
        asked = f"{item} was dropped. Lay it in front of the robot, its tag in view, step back, and press y."
        if not world.operator.confirm(asked):
            raise RunStopped(f"{item} was dropped on the way")
        again = self.pick(item)
        if again.result.kind is not Handling.DONE:
            reason = again.result.message
            raise RunStopped(f"{item} was dropped on the way, and could not be grasped again: {reason}")
        return True

    def secure(self) -> None:
        """Before the robot sits down: stow the arm with what it holds, or put that down in front of the robot.

        Never raises because of the robot.
        """
        self._world.ending = True
        try:
            if not self._holds():
                if self._state().manipulator_state.stow_state == robot_state_pb2.ManipulatorState.STOWSTATE_DEPLOYED:
                    self._command(RobotCommandBuilder.arm_stow_command())
                return
            if self._command(RobotCommandBuilder.arm_stow_command()).kind is not ArmOutcome.DONE:
                self._put_down((AHEAD_M, 0.0, FLOOR_M - BODY_M))
        except (*ROBOT_ERRORS, LiosError) as error:
            self._world.tell(f"The arm was left as it is: {error}")

    def _turned(self, item: ItemId, reason: str) -> bool:
        """Whether a helper turned the item."""
        asked = f"The robot could not grasp {item} ({reason}). Turn it, its tag to the robot, step back, and press y."
        return self._world.operator.confirm(asked)

    def _from_the_robot(self, sighting: TagSighting) -> Position | None:
        """The level direction from the body to a tag, in the vision frame."""
        body = tform(self._state().kinematic_state.transforms_snapshot, VISION_FRAME_NAME, BODY_FRAME_NAME)
        if body is None:
            return None
        dx, dy = sighting.in_vision[0] - body.x, sighting.in_vision[1] - body.y
        away = hypot(dx, dy) or TINY
        return (dx / away, dy / away, 0.0)

    def _carry(self, item: ItemId) -> None:
        """Carry what is held.

        By default the robot takes everything for not carriable: it does not stow it, and lets go of it when the
        connection breaks off (manipulation_api.proto; SDK example arm_grasp_carry_override).
        """
        world, client = self._world, self._world.connection.client("manipulation")
        request = manipulation_api_pb2.ApiGraspOverrideRequest(
            api_grasp_override=manipulation_api_pb2.ApiGraspOverride(
                override_request=manipulation_api_pb2.ApiGraspOverride.OVERRIDE_HOLDING
            ),
            carry_state_override=manipulation_api_pb2.ApiGraspedCarryStateOverride(
                override_request=robot_state_pb2.ManipulatorState.CARRY_STATE_CARRIABLE_AND_STOWABLE
            ),
        )
        try:
            world.call(lambda: client.grasp_override_command(request, timeout=world.connection.timeout_s))
        except ResponseError as error:
            world.tell(f"{item} may be dropped if the connection breaks off ({reason_of(error)})")
        self._command(RobotCommandBuilder.arm_carry_command())
        self._carrying = item

    def _put_down(self, at: Position) -> Result[ArmOutcome]:
        """Put down what is held, by way of a point in front of the place, and go back by it before stowing."""
        before = in_front_of(at)
        ended = self._command(hand_to(before))
        if ended.kind is ArmOutcome.DONE:
            ended = self._command(hand_to(at))
        if ended.kind is not ArmOutcome.DONE:
            self._command(hand_to(before))
            return ended
        self._command(RobotCommandBuilder.claw_gripper_open_command())
        stays = self._holds()
        self._command(hand_to(before))
        if stays:
            return ArmOutcome.STILL_HOLDS.result()
        self._command(close_gripper())
        self._command(RobotCommandBuilder.arm_stow_command())
        return ended

    def _find(self, item: ItemId) -> TagSighting | Result[Handling]:
        """A sighting of the item's tag within the last FRESH_S, of a pose that is sure.

        After FIND_S, whether there was none or its pose was unsure.
        """
        world, failure = self._world, Handling.NOT_SEEN.result(item=item)
        end_ns = world.now_ns() + round(FIND_S * 1e9)
        while True:
            for sighting in world.sightings() or ():
                known = world.site.tags.get(sighting.tag)
                if known is None or known.id != item or world.now_ns() - sighting.stamp_ns > round(FRESH_S * 1e9):
                    continue
                if sighting.reliable:
                    return sighting
                failure = Handling.POSE_UNSURE.result(item=item)
            if world.now_ns() > end_ns:
                return failure
            world.wait(world.settings.poll_s)

    def _grasp(self, sighting: TagSighting, direction: Position | None) -> Result[Handling]:
        world, client = self._world, self._world.connection.client("manipulation")
        request = manipulation_api_pb2.ManipulationApiRequest(pick_object=grasp_from(sighting.in_vision, direction))
        try:
            answer: manipulation_api_pb2.ManipulationApiResponse = world.call(
                lambda: client.manipulation_api_command(request, timeout=world.connection.timeout_s)
            )
        except ResponseError as error:
            return Handling.GRASP_REFUSED.result(reason=reason_of(error))
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
                return Handling.DONE.result() if self._holds() else Handling.GRASP_EMPTY.result()
            if state in _FAILED:
                break
        name = manipulation_api_pb2.ManipulationFeedbackState.Name(state)
        return Handling.GRASP_FAILED.result(state=name.removeprefix("MANIP_STATE_").lower())

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
        if body is None or world.at is None or world.at == START or stop_point(world.at) is not None:
            return (AHEAD_M, 0.0, FLOOR_M - height_m)
        here = Pose(x_m=body.position.x, y_m=body.position.y, yaw_rad=SE3Pose.from_proto(body).rot.to_yaw())
        return place_on(world.plan.container(ContainerId(world.at)), here, height_m)

    def _state(self) -> robot_state_pb2.RobotState:
        world = self._world
        return world.call(
            lambda: world.connection.client("robot-state").get_robot_state(timeout=world.connection.timeout_s)
        )

    def _command(self, command: robot_command_pb2.RobotCommand) -> Result[ArmOutcome]:
        """Execute an arm command and wait for its end."""
        world, client = self._world, self._world.connection.client("robot-command")
        world.connection.clock.refresh()
        try:
            number: int = world.call(lambda: client.robot_command(command, timeout=world.connection.timeout_s))
        except ResponseError as error:
            return ArmOutcome.REFUSED.result(reason=reason_of(error))
        end_ns = world.now_ns() + round(ARM_LIMIT_S * 1e9)
        while world.now_ns() < end_ns:
            world.wait(world.settings.poll_s)
            answer: robot_command_pb2.RobotCommandFeedbackResponse = world.call(
                lambda: client.robot_command_feedback(number, timeout=world.connection.timeout_s)
            )
            ended = command_result(answer.feedback.synchronized_feedback)
            if ended.kind is not ArmOutcome.RUNNING:
                return ended
        return ArmOutcome.LATE.result(limit_s=f"{ARM_LIMIT_S:g}")


_FAILED = (
    manipulation_api_pb2.MANIP_STATE_GRASP_FAILED,
    manipulation_api_pb2.MANIP_STATE_GRASP_PLANNING_NO_SOLUTION,
    manipulation_api_pb2.MANIP_STATE_GRASP_FAILED_TO_RAYCAST_INTO_MAP,
)
"""At the edge of the hand camera's view (WAITING_DATA_AT_EDGE) the robot aims again by itself: the grasp has not
ended."""
