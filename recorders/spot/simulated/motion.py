"""How is the robot told to move? Robot commands, GraphNav, manipulation."""

from __future__ import annotations

from math import hypot, inf
from typing import Any

from bosdyn.api import (
    arm_command_pb2,
    basic_command_pb2,
    data_chunk_pb2,
    full_body_command_pb2,
    gripper_command_pb2,
    manipulation_api_pb2,
    manipulation_api_service_pb2_grpc,
    mobility_command_pb2,
    robot_command_pb2,
    robot_command_service_pb2_grpc,
    synchronized_command_pb2,
)
from bosdyn.api.graph_nav import graph_nav_pb2, graph_nav_service_pb2_grpc, map_pb2, nav_pb2

from recorders.spot.simulated.body import Body, Motors, WalkState, wrapped
from recorders.spot.simulated.frames import (
    frame_tree,
    from_body,
    height_of,
    inverse,
    point_in_map,
    pose_in_map,
    se3,
    stamp,
    yaw_of,
)
from recorders.spot.simulated.robot import PICK_S, PLACE_S, RobotState
from recorders.spot.simulated.services import header_of
from workbench.runs.vocabulary import NANO
from workbench.worlds.geometry import Pose

PROCESSING = basic_command_pb2.RobotCommandFeedbackStatus.STATUS_PROCESSING
OVERRIDDEN = basic_command_pb2.RobotCommandFeedbackStatus.STATUS_COMMAND_OVERRIDDEN


class Commands(robot_command_service_pb2_grpc.RobotCommandServiceServicer):
    """Stand, sit, stop, walk to a pose, power off safely, arm and gripper."""

    def __init__(self, state: RobotState) -> None:
        self._state = state

    def RobotCommand(self, request: Any, context: Any) -> Any:
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
            number = self._obey(state, request.command)
            response.status = answer.STATUS_UNSUPPORTED if number is None else answer.STATUS_OK
            response.robot_command_id = number or 0
            return response

    def RobotCommandFeedback(self, request: Any, context: Any) -> Any:
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

    def ClearBehaviorFault(self, request: Any, context: Any) -> Any:
        answer = robot_command_pb2.ClearBehaviorFaultResponse
        return answer(header=header_of(self._state, request), status=answer.STATUS_CLEARED)

    def _obey(self, state: RobotState, command: Any) -> int | None:
        body, full, sync = state.body, command.full_body_command, command.synchronized_command
        if full.HasField("safe_power_off_request"):
            body.power_off()
            return state.number("safe-power-off")
        if full.HasField("stop_request") or full.HasField("freeze_request"):
            body.halt(WalkState.STOPPED)
            return state.number("stop")
        number = None
        if sync.HasField("mobility_command"):
            number = self._move(state, sync.mobility_command)
        if sync.HasField("arm_command"):
            state.arm_deployed = not sync.arm_command.HasField("named_arm_position_command") or (
                sync.arm_command.named_arm_position_command.position
                != arm_command_pb2.NamedArmPositionsCommand.POSITIONS_STOW
            )
            state.arm_busy_until_s = body.lived_s + PLACE_S
            number = state.number("arm")
        if sync.HasField("gripper_command"):
            points = sync.gripper_command.claw_gripper_command.trajectory.points
            if points and abs(points[-1].point) > 0.2:
                state.open_gripper()
            else:
                state.gripper_open = False
            number = number or state.number("gripper")
        return number

    def _move(self, state: RobotState, command: Any) -> int | None:
        body = state.body
        if command.HasField("se2_trajectory_request"):
            wanted = command.se2_trajectory_request
            goal = wanted.trajectory.points[-1].pose
            pose = pose_in_map(body, wanted.se2_frame_name, goal.position.x, goal.position.y, goal.angle)
            if pose is None:
                return None
            lasts = _lasts(state, wanted.end_time) if wanted.HasField("end_time") else inf
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


def _lasts(state: RobotState, end_time: Any) -> float:
    """For how many seconds of the body's life a command may go on."""
    left = (end_time.seconds * NANO + end_time.nanos - state.clock.robot_ns()) / NANO
    return left * getattr(state.clock, "speed_up", 1.0)


def _feedback(state: RobotState, kind: str, number: int) -> synchronized_command_pb2.SynchronizedCommand.Feedback:
    body = state.body
    feedback = synchronized_command_pb2.SynchronizedCommand.Feedback()
    moving = mobility_command_pb2.MobilityCommand.Feedback(status=PROCESSING)
    if kind == "stand":
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
            there = walk.state is not WalkState.WALKING
            moving.se2_trajectory_feedback.status = going.STATUS_AT_GOAL if there else going.STATUS_GOING_TO_GOAL
    if kind in ("arm", "gripper"):
        done = body.lived_s >= state.arm_busy_until_s
        claw, arm = gripper_command_pb2.ClawGripperCommand.Feedback, arm_command_pb2
        feedback.arm_command_feedback.status = PROCESSING
        feedback.arm_command_feedback.named_arm_position_feedback.status = (
            arm.NamedArmPositionsCommand.Feedback.STATUS_COMPLETE
            if done
            else arm.NamedArmPositionsCommand.Feedback.STATUS_IN_PROGRESS
        )
        feedback.gripper_command_feedback.claw_gripper_feedback.status = (
            claw.STATUS_AT_GOAL if done else claw.STATUS_IN_PROGRESS
        )
    else:
        feedback.mobility_command_feedback.CopyFrom(moving)
    return feedback


class GraphNav(graph_nav_service_pb2_grpc.GraphNavServiceServicer):
    """A waypoint wherever the site has one; the seed frame is the site's map."""

    def __init__(self, state: RobotState) -> None:
        self._state = state
        site = state.site
        names = {place: site.waypoints.get(place) or f"wp-{place}" for place in site.travel.locations}
        self._waypoints = {name: site.ways.standing[place] for place, name in names.items()}

    def GetLocalizationState(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            response = graph_nav_pb2.GetLocalizationStateResponse(header=header_of(state, request))
            response.robot_kinematics.CopyFrom(kinematics(state))
            response.lost_detector_state.is_lost = not state.localized
            if state.localized:
                response.localization.CopyFrom(self._localization(state))
            return response

    def SetLocalization(self, request: Any, context: Any) -> Any:
        answer = graph_nav_pb2.SetLocalizationResponse
        with self._state.alive() as state:
            guess = request.initial_guess.waypoint_id
            if guess and guess not in self._waypoints:
                return answer(header=header_of(state, request), status=answer.STATUS_UNKNOWN_WAYPOINT)
            if request.fiducial_init == graph_nav_pb2.SetLocalizationRequest.FIDUCIAL_INIT_NO_FIDUCIAL and not guess:
                return answer(header=header_of(state, request), status=answer.STATUS_FAILED)
            state.localized = True
            return answer(
                header=header_of(state, request), status=answer.STATUS_OK, localization=self._localization(state)
            )

    def NavigateTo(self, request: Any, context: Any) -> Any:
        answer = graph_nav_pb2.NavigateToResponse
        with self._state.alive() as state:
            goal = self._waypoints.get(request.destination_waypoint_id)
            if goal is None:
                status = answer.STATUS_UNKNOWN_WAYPOINT
                return answer(
                    header=header_of(state, request), lease_use_results=_used(state, request), status=status
                )
            if request.HasField("destination_waypoint_tform_body_goal"):
                offset = request.destination_waypoint_tform_body_goal
                goal = _shifted(goal, offset.position.x, offset.position.y, offset.angle)
            return self._navigate(state, request, goal, answer)

    def NavigateToAnchor(self, request: Any, context: Any) -> Any:
        answer = graph_nav_pb2.NavigateToAnchorResponse
        with self._state.alive() as state:
            goal = request.seed_tform_goal
            pose = Pose(x_m=goal.position.x, y_m=goal.position.y, yaw_rad=yaw_of(goal.rotation))
            return self._navigate(state, request, pose, answer)

    def NavigationFeedback(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            return _navigation_feedback(state, request)

    def DownloadGraph(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            return graph_nav_pb2.DownloadGraphResponse(header=header_of(state, request), graph=self._graph(state))

    def DownloadGraphStreaming(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            graph = self.DownloadGraph(request, context).SerializeToString()
            yield graph_nav_pb2.DownloadGraphStreamingResponse(
                header=header_of(state, request), chunk=data_chunk_pb2.DataChunk(total_size=len(graph), data=graph)
            )

    def _navigate(self, state: RobotState, request: Any, goal: Pose, answer: Any) -> Any:
        results = _used(state, request)
        response = answer(header=header_of(state, request), lease_use_results=results)
        lasts = _lasts(state, request.end_time)
        if any(result.status != result.STATUS_OK for result in results) or not results:
            response.status = answer.STATUS_OK
            return response
        if not request.clock_identifier:
            response.status = answer.STATUS_NO_TIMESYNC
        elif lasts <= 0:
            response.status = answer.STATUS_EXPIRED
        elif state.body.motors is not Motors.ON:
            response.status = answer.STATUS_ROBOT_IMPAIRED
        elif not state.localized:
            response.status = answer.STATUS_NOT_LOCALIZED_TO_MAP
        else:
            limit = request.travel_params.velocity_limit.max_vel.linear.x or None
            turn = not request.travel_params.ignore_final_yaw
            number = state.walk_to(goal, speed_mps=limit, lasts_s=lasts, turn=turn)
            response.status = answer.STATUS_NO_PATH if number is None else answer.STATUS_OK
            response.command_id = number or 0
        return response

    def _localization(self, state: RobotState) -> nav_pb2.Localization:
        pose = state.body.pose
        name = min(
            self._waypoints, key=lambda n: hypot(self._waypoints[n].x_m - pose.x_m, self._waypoints[n].y_m - pose.y_m)
        )
        at = self._waypoints[name]
        local = _relative(at, pose)
        height = height_of(state.body)
        return nav_pb2.Localization(
            waypoint_id=name,
            waypoint_tform_body=se3(local.x_m, local.y_m, height, local.yaw_rad),
            seed_tform_body=se3(pose.x_m, pose.y_m, height, pose.yaw_rad),
            timestamp=stamp(state.clock.robot_ns()),
        )

    def _graph(self, state: RobotState) -> map_pb2.Graph:
        graph = map_pb2.Graph()
        for name, pose in self._waypoints.items():
            waypoint = graph.waypoints.add(id=name, waypoint_tform_ko=inverse(pose, 0.0))
            waypoint.annotations.name = name
            graph.anchoring.anchors.add(id=name, seed_tform_waypoint=se3(pose.x_m, pose.y_m, 0.0, pose.yaw_rad))
        for a, b in _tree(list(self._waypoints), state):
            edge = graph.edges.add()
            edge.id.from_waypoint, edge.id.to_waypoint = a, b
            shift = _relative(self._waypoints[a], self._waypoints[b])
            edge.from_tform_to.CopyFrom(se3(shift.x_m, shift.y_m, 0.0, shift.yaw_rad))
        return graph


def _used(state: RobotState, request: Any) -> list[Any]:
    return [state.leases.use(lease) for lease in request.leases]


def _navigation_feedback(state: RobotState, request: Any) -> Any:
    answer = graph_nav_pb2.NavigationFeedbackResponse
    walk = state.body.walk
    response = answer(header=header_of(state, request))
    if walk is None:
        response.status = answer.STATUS_NO_ROUTE
        return response
    if request.command_id and request.command_id != walk.number:
        response.status = answer.STATUS_COMMAND_OVERRIDDEN
        return response
    response.command_id = walk.number
    response.remaining_route_length = walk.left_m(state.body.pose.point)
    response.status = {
        WalkState.WALKING: answer.STATUS_FOLLOWING_ROUTE,
        WalkState.ARRIVED: answer.STATUS_REACHED_GOAL,
        WalkState.STUCK: answer.STATUS_STUCK,
        WalkState.LOST: answer.STATUS_LOST,
        WalkState.STOPPED: answer.STATUS_COMMAND_OVERRIDDEN,
        WalkState.EXPIRED: answer.STATUS_COMMAND_TIMED_OUT,
        WalkState.NO_LEASE: answer.STATUS_LEASE_ERROR,
        WalkState.IMPAIRED: answer.STATUS_ROBOT_IMPAIRED,
    }[walk.state]
    if walk.state is WalkState.STUCK:
        response.stuck_reason = answer.STUCK_REASON_OBSTACLE
    return response


def _tree(names: list[str], state: RobotState) -> list[tuple[str, str]]:
    """A spanning tree of the waypoints by walking distance (Prim)."""
    metres = state.site.travel.metres
    joined, edges = [0], []
    while len(joined) < len(names):
        _, a, b = min((metres[i, j], i, j) for i in joined for j in range(len(names)) if j not in joined)
        edges.append((names[a], names[b]))
        joined.append(b)
    return edges


def _shifted(pose: Pose, x: float, y: float, turn: float) -> Pose:
    moved = from_body(Body(pose=pose, speed_mps=1.0), (x, y, 0.0))
    return Pose(x_m=moved[0], y_m=moved[1], yaw_rad=wrapped(pose.yaw_rad + turn))


def _relative(origin: Pose, pose: Pose) -> Pose:
    """A pose seen from another."""
    from recorders.spot.simulated.frames import in_body

    x, y, _ = in_body(Body(pose=origin, speed_mps=1.0), (pose.x_m, pose.y_m, 0.0))
    return Pose(x_m=x, y_m=y, yaw_rad=wrapped(pose.yaw_rad - origin.yaw_rad))


def kinematics(state: RobotState) -> Any:
    """The kinematic state: frames and velocities, without joints."""
    from bosdyn.api import robot_state_pb2

    message = robot_state_pb2.KinematicState(
        acquisition_timestamp=stamp(state.clock.robot_ns()), transforms_snapshot=frame_tree(state.body)
    )
    message.velocity_of_body_in_odom.linear.x = state.body.speed_now
    message.velocity_of_body_in_vision.linear.x = state.body.speed_now
    return message


class Manipulation(manipulation_api_service_pb2_grpc.ManipulationApiServiceServicer):
    """Grasps what lies at a point, in PICK_S seconds."""

    def __init__(self, state: RobotState) -> None:
        self._state = state

    def ManipulationApi(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            response = manipulation_api_pb2.ManipulationApiResponse(
                header=header_of(state, request), lease_use_result=used
            )
            if used.status != used.STATUS_OK:
                return response
            if request.HasField("pick_object") and state.body.motors is Motors.ON:
                wanted = request.pick_object
                point = (wanted.object_rt_frame.x, wanted.object_rt_frame.y, wanted.object_rt_frame.z)
                at = point_in_map(state.body, wanted.frame_name, point)
                response.manipulation_cmd_id = state.begin_grasp(at) if at is not None else state.number("grasp")
            else:
                response.manipulation_cmd_id = state.number("grasp")
            return response

    def ManipulationApiFeedback(self, request: Any, context: Any) -> Any:
        api = manipulation_api_pb2
        with self._state.alive() as state:
            grasp = state.grasp
            known = grasp is not None and grasp.number == request.manipulation_cmd_id
            if not known or grasp is None or state.body.motors is not Motors.ON:
                status = api.MANIP_STATE_GRASP_FAILED
            elif (took := state.body.lived_s - grasp.began_s) < PICK_S:
                phases = (
                    api.MANIP_STATE_SEARCHING_FOR_GRASP,
                    api.MANIP_STATE_MOVING_TO_GRASP,
                    api.MANIP_STATE_GRASPING_OBJECT,
                )
                status = phases[min(2, int(3 * took / PICK_S))]
            elif grasp.thing is not None and grasp.thing.held:
                status = api.MANIP_STATE_GRASP_SUCCEEDED
            else:
                status = api.MANIP_STATE_GRASP_FAILED
            return api.ManipulationApiFeedbackResponse(
                header=header_of(state, request),
                manipulation_cmd_id=request.manipulation_cmd_id,
                current_state=status,
                transforms_snapshot_manipulation_data=frame_tree(state.body),
            )

    def OverrideGrasp(self, request: Any, context: Any) -> Any:
        return manipulation_api_pb2.ApiGraspOverrideResponse(header=header_of(self._state, request))
