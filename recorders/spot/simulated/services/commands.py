"""The simulated robot command service: stand, sit, stop, walk to a pose, power off, arm and gripper."""

from __future__ import annotations

from math import inf

import grpc
from bosdyn.api import (
    arm_command_pb2,
    basic_command_pb2,
    full_body_command_pb2,
    gripper_command_pb2,
    mobility_command_pb2,
    robot_command_pb2,
    robot_command_service_pb2_grpc,
    robot_state_pb2,
    synchronized_command_pb2,
)
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.body import Motors, WalkState
from recorders.spot.simulated.frames import pose_in_map
from recorders.spot.simulated.robot import PLACE_S, SimulatedState
from workbench.log_schema.events import NANO

PROCESSING = basic_command_pb2.RobotCommandFeedbackStatus.STATUS_PROCESSING
FRONT_M = 0.6
"""Distance in metres from the body's centre beyond which the hand is over what the robot stands at."""
MOBILITY = ("stand", "sit", "walk", "stop", "safe-power-off")
"""Commands to the legs: each replaces the one before it."""
OVERRIDDEN = basic_command_pb2.RobotCommandFeedbackStatus.STATUS_COMMAND_OVERRIDDEN

GOAL_STATUS = {
    WalkState.WALKING: basic_command_pb2.SE2TrajectoryCommand.Feedback.FINAL_GOAL_STATUS_IN_PROGRESS,
    WalkState.ARRIVED: basic_command_pb2.SE2TrajectoryCommand.Feedback.FINAL_GOAL_STATUS_ACHIEVABLE,
    WalkState.STUCK: basic_command_pb2.SE2TrajectoryCommand.Feedback.FINAL_GOAL_STATUS_BLOCKED,
}


class Commands(robot_command_service_pb2_grpc.RobotCommandServiceServicer):
    """Stand, sit, stop, walk to a pose, power off safely, arm and gripper."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def RobotCommand(
        self, request: robot_command_pb2.RobotCommandRequest, context: grpc.ServicerContext
    ) -> robot_command_pb2.RobotCommandResponse:
        answer = robot_command_pb2.RobotCommandResponse
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            response = answer(header=header_of(state, request), lease_use_result=used, status=answer.STATUS_OK)
            if used.status != used.STATUS_OK:
                return response
            full = request.command.full_body_command
            if not full.HasField("safe_power_off_request") and state.body.motors is not Motors.ON:
                response.status = answer.STATUS_NOT_POWERED_ON
                return response
            if state.behaviour_fault and not full.HasField("safe_power_off_request"):
                response.status = answer.STATUS_BEHAVIOR_FAULT
                return response
            if state.dock is not None and not full.HasField("safe_power_off_request"):
                response.status = answer.STATUS_DOCKED
                return response
            number = self._obey(state, request.command)
            response.status = answer.STATUS_UNSUPPORTED if number is None else answer.STATUS_OK
            response.robot_command_id = number or 0
            return response

    def RobotCommandFeedback(
        self, request: robot_command_pb2.RobotCommandFeedbackRequest, context: grpc.ServicerContext
    ) -> robot_command_pb2.RobotCommandFeedbackResponse:
        with self._state.alive() as state:
            kind = state.commands.get(request.robot_command_id, "")
            feedback = robot_command_pb2.RobotCommandFeedback()
            if kind == "safe-power-off":
                done = full_body_command_pb2.FullBodyCommand.Feedback(status=PROCESSING)
                done.safe_power_off_feedback.status = (
                    basic_command_pb2.SafePowerOffCommand.Feedback.STATUS_POWERED_OFF
                )
                feedback.full_body_feedback.CopyFrom(done)
            elif kind == "stop":
                feedback.full_body_feedback.status = PROCESSING
                feedback.full_body_feedback.stop_feedback.SetInParent()
            else:
                feedback.synchronized_feedback.CopyFrom(_feedback(state, kind, request.robot_command_id))
            return robot_command_pb2.RobotCommandFeedbackResponse(header=header_of(state, request), feedback=feedback)

    def ClearBehaviorFault(
        self, request: robot_command_pb2.ClearBehaviorFaultRequest, context: grpc.ServicerContext
    ) -> robot_command_pb2.ClearBehaviorFaultResponse:
        answer = robot_command_pb2.ClearBehaviorFaultResponse
        return answer(header=header_of(self._state, request), status=answer.STATUS_CLEARED)

    def _obey(self, state: SimulatedState, command: robot_command_pb2.RobotCommand) -> int | None:
        body, full, sync = state.body, command.full_body_command, command.synchronized_command
        if full.HasField("safe_power_off_request"):
            if state.held is not None and state.arm_deployed:
                state.arm_mishaps.append("sat down on what it held")
            body.power_off()
            return state.number("safe-power-off")
        if full.HasField("stop_request") or full.HasField("freeze_request"):
            body.halt(WalkState.STOPPED)
            return state.number("stop")
        number = None
        if sync.HasField("mobility_command"):
            number = self._move(state, sync.mobility_command)
        if sync.HasField("arm_command"):
            number = _move_arm(state, sync.arm_command)
        if sync.HasField("gripper_command"):
            points = sync.gripper_command.claw_gripper_command.trajectory.points
            if points and abs(points[-1].point) > 0.2:
                state.released_at, state.released_goal = state.arm_at, state.arm_goal
                state.open_gripper()
            else:
                state.gripper_open = False
            number = number or state.number("gripper")
        return number

    def _move(self, state: SimulatedState, command: mobility_command_pb2.MobilityCommand.Request) -> int | None:
        body = state.body
        if command.HasField("se2_trajectory_request"):
            wanted = command.se2_trajectory_request
            goal = wanted.trajectory.points[-1].pose
            pose = pose_in_map(body, wanted.se2_frame_name, goal.position.x, goal.position.y, goal.angle)
            if pose is None:
                return None
            lasts = lasts_s(state, wanted.end_time) if wanted.HasField("end_time") else inf
            return state.walk_to(pose, speed_mps=None, lasts_s=lasts)
        if command.HasField("stand_request"):
            body.stand(True)
            return state.number("stand")
        if command.HasField("sit_request"):
            body.halt(WalkState.STOPPED)
            body.stand(False)
            return state.number("sit")
        if command.HasField("stop_request") or command.HasField("se2_velocity_request"):
            body.halt(WalkState.STOPPED)
            return state.number("stop")
        return None


def _move_arm(state: SimulatedState, command: arm_command_pb2.ArmCommand.Request) -> int:
    """Move the arm; what a careless motion would run into is noted."""
    named = arm_command_pb2.NamedArmPositionsCommand
    state.arm_busy_until_s = state.body.lived_s + PLACE_S
    number = state.number("arm")
    if not command.HasField("arm_cartesian_command"):
        stow = command.named_arm_position_command.position == named.POSITIONS_STOW
        stowable = robot_state_pb2.ManipulatorState.CARRY_STATE_CARRIABLE_AND_STOWABLE
        if stow and state.held is not None and state.carry_state != stowable:
            state.commands[number] = "arm-frozen"
            return number
        if state.arm_at is not None and stow and state.arm_at == state.released_at:
            state.arm_mishaps.append("stowed from where it let go, through what stands there")
        state.arm_deployed, state.arm_at = not stow, None
        return number
    sent = command.arm_cartesian_command
    to = sent.pose_trajectory_in_task.points[-1].pose.position
    goal = (to.x, to.y, to.z)
    if not sent.HasField("max_linear_velocity") or not sent.HasField("max_angular_velocity"):
        state.arm_mishaps.append("moved without a speed limit")
    if state.arm_at is None and state.held is not None and to.x > FRONT_M:
        state.arm_mishaps.append("reached straight in")
    state.arm_deployed, state.arm_at = True, goal
    state.arm_goal = (sent.root_frame_name, *goal)
    state.commands[number] = "arm-pose"
    return number


def lasts_s(state: SimulatedState, end_time: Timestamp) -> float:
    """Remaining time of a command in seconds of body time."""
    left = (end_time.seconds * NANO + end_time.nanos - state.clock.robot_ns()) / NANO
    return left * getattr(state.clock, "speed_up", 1.0)


def _feedback(state: SimulatedState, kind: str, number: int) -> synchronized_command_pb2.SynchronizedCommand.Feedback:
    body = state.body
    feedback = synchronized_command_pb2.SynchronizedCommand.Feedback()
    moving = mobility_command_pb2.MobilityCommand.Feedback(status=PROCESSING)
    if kind in ("stand", "sit") and any(
        later > number and what in MOBILITY for later, what in state.commands.items()
    ):
        moving.status = OVERRIDDEN
    elif kind == "stand":
        up = basic_command_pb2.StandCommand.Feedback
        moving.stand_feedback.status = up.STATUS_IS_STANDING if body.settled else up.STATUS_IN_PROGRESS
    elif kind == "sit":
        down = basic_command_pb2.SitCommand.Feedback
        moving.sit_feedback.status = down.STATUS_IS_SITTING if body.settled else down.STATUS_IN_PROGRESS
    elif kind == "walk":
        walk, going = body.walk, basic_command_pb2.SE2TrajectoryCommand.Feedback
        if walk is None or walk.number != number:
            moving.status = OVERRIDDEN
        else:
            walks = walk.state is WalkState.WALKING
            moving.se2_trajectory_feedback.status = going.STATUS_IN_PROGRESS if walks else going.STATUS_STOPPED
            moving.se2_trajectory_feedback.final_goal_status = GOAL_STATUS.get(
                walk.state, going.FINAL_GOAL_STATUS_UNKNOWN
            )
    done = body.lived_s >= state.arm_busy_until_s
    if kind == "arm-pose":
        pose = arm_command_pb2.ArmCartesianCommand.Feedback
        there = pose.STATUS_TRAJECTORY_STALLED if state.arm_stalls else pose.STATUS_TRAJECTORY_COMPLETE
        feedback.arm_command_feedback.status = PROCESSING
        feedback.arm_command_feedback.arm_cartesian_feedback.status = there if done else pose.STATUS_IN_PROGRESS
    elif kind == "gripper":
        claw = gripper_command_pb2.ClawGripperCommand.Feedback
        there = claw.STATUS_AT_GOAL if done else claw.STATUS_IN_PROGRESS
        feedback.gripper_command_feedback.status = PROCESSING
        feedback.gripper_command_feedback.claw_gripper_feedback.status = there
    elif kind == "arm-frozen":
        feedback.arm_command_feedback.status = PROCESSING
        feedback.arm_command_feedback.named_arm_position_feedback.status = (
            arm_command_pb2.NamedArmPositionsCommand.Feedback.STATUS_STALLED_HOLDING_ITEM
        )
    elif kind == "arm":
        arm = arm_command_pb2
        feedback.arm_command_feedback.status = PROCESSING
        feedback.arm_command_feedback.named_arm_position_feedback.status = (
            arm.NamedArmPositionsCommand.Feedback.STATUS_COMPLETE
            if done
            else arm.NamedArmPositionsCommand.Feedback.STATUS_IN_PROGRESS
        )
    else:
        feedback.mobility_command_feedback.CopyFrom(moving)
    return feedback
