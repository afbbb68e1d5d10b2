#!/usr/bin/env bash
# bosdyn-client 5.2.0: the SDK's waits call a walk done that was blocked, and wait without end for an arm that was called off.
#
# Expected: block_for_trajectory_cmd returns True for a trajectory that is "considered successfully complete", and
#   block_until_arm_arrives False where "the arm stalled or the move was canceled".
# What happens: STATUS_STOPPED, which the first waits for, says only that the robot stands (STATUS_AT_GOAL is another name of
#   the same number). Whether it stands at the goal is in final_goal_status, which is not read: in front of a chair the
#   answer is True. Neither wait reads the status of the command itself: of one that another command has replaced, that has
#   expired, or that the robot drops because it froze, they go on asking until timeout_sec, which by default is never. A
#   cancelled impedance move is also waited for.
# Who is hurt: whoever moves Spot by these helpers: the next step starts at the wrong place, or a script hangs after the
#   operator took over.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0
cd "$folder"
cat > show.py <<'PY'
from concurrent.futures import ThreadPoolExecutor

import grpc
from bosdyn.api import arm_command_pb2, basic_command_pb2, header_pb2, robot_command_pb2
from bosdyn.api import robot_command_service_pb2_grpc as service
from bosdyn.client.robot_command import RobotCommandClient, block_for_trajectory_cmd, block_until_arm_arrives

Command = basic_command_pb2.RobotCommandFeedbackStatus
Walk = basic_command_pb2.SE2TrajectoryCommand.Feedback
Impedance = arm_command_pb2.ArmImpedanceCommand.Feedback
TIMEOUT_S = 2


class Robot(service.RobotCommandServiceServicer):
    """Answers each request for feedback with the same one, and counts."""

    def RobotCommandFeedback(self, request, context):
        self.asked += 1
        return self.answer


robot = Robot()
server = grpc.server(ThreadPoolExecutor(1))
service.add_RobotCommandServiceServicer_to_server(robot, server)
port = server.add_insecure_port("127.0.0.1:0")
server.start()
client = RobotCommandClient()
client.channel = grpc.insecure_channel(f"127.0.0.1:{port}")


def ask(title, wait, fill):
    robot.answer, robot.asked = robot_command_pb2.RobotCommandFeedbackResponse(), 0
    robot.answer.header.error.code = header_pb2.CommonError.CODE_OK
    fill(robot.answer.feedback.synchronized_feedback)
    result = wait(client, 1, timeout_sec=TIMEOUT_S)
    print(f"{title}: {result}", "at once" if robot.asked == 1 else "after the timeout")


def walk(status, state, goal):
    def fill(feedback):
        feedback.mobility_command_feedback.status = status
        feedback.mobility_command_feedback.se2_trajectory_feedback.status = state
        feedback.mobility_command_feedback.se2_trajectory_feedback.final_goal_status = goal

    return fill


def arm(status, impedance=None):
    def fill(feedback):
        feedback.arm_command_feedback.status = status
        if impedance is not None:
            feedback.arm_command_feedback.arm_impedance_feedback.status = impedance

    return fill


print("STATUS_AT_GOAL is STATUS_STOPPED:", Walk.STATUS_AT_GOAL == Walk.STATUS_STOPPED)
going, achievable, blocked = Command.STATUS_PROCESSING, Walk.FINAL_GOAL_STATUS_ACHIEVABLE, Walk.FINAL_GOAL_STATUS_BLOCKED
ask("walk, arrived", block_for_trajectory_cmd, walk(going, Walk.STATUS_STOPPED, achievable))
ask("walk, goal blocked", block_for_trajectory_cmd, walk(going, Walk.STATUS_STOPPED, blocked))
for status in (Command.STATUS_COMMAND_OVERRIDDEN, Command.STATUS_COMMAND_TIMED_OUT, Command.STATUS_ROBOT_FROZEN):
    name = Command.Status.Name(status).removeprefix("STATUS_").lower()
    ask(f"walk, {name}", block_for_trajectory_cmd, walk(status, Walk.STATUS_IN_PROGRESS, achievable))
    ask(f"arm, {name}", block_until_arm_arrives, arm(status))
ask("arm, impedance move cancelled", block_until_arm_arrives, arm(going, Impedance.STATUS_TRAJECTORY_CANCELLED))
ask("arm, impedance move stalled", block_until_arm_arrives, arm(going, Impedance.STATUS_TRAJECTORY_STALLED))
server.stop(None)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "STATUS_AT_GOAL is STATUS_STOPPED: True
walk, arrived: True at once
walk, goal blocked: True at once
walk, command_overridden: False after the timeout
arm, command_overridden: False after the timeout
walk, command_timed_out: False after the timeout
arm, command_timed_out: False after the timeout
walk, robot_frozen: False after the timeout
arm, robot_frozen: False after the timeout
arm, impedance move cancelled: False after the timeout
arm, impedance move stalled: False at once" ]
