"""How does the robot find its way? GraphNav: a waypoint where the site has one, the site's map as the seed frame."""

from __future__ import annotations

from math import hypot
from typing import Any

from bosdyn.api import data_chunk_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, graph_nav_service_pb2_grpc, map_pb2, nav_pb2

from recorders.spot.simulated.body import Body, Motors, WalkState, wrapped
from recorders.spot.simulated.commands import lasts_s
from recorders.spot.simulated.frames import from_body, height_of, in_body, inverse, kinematics, se3, stamp, yaw_of
from recorders.spot.simulated.robot import RobotState
from recorders.spot.simulated.services import header_of
from workbench.worlds.geometry import Pose


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
            response.robot_kinematics.CopyFrom(kinematics(state.body, state.clock.robot_ns()))
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
        lasts = lasts_s(state, request.end_time)
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
    x, y, _ = in_body(Body(pose=origin, speed_mps=1.0), (pose.x_m, pose.y_m, 0.0))
    return Pose(x_m=x, y_m=y, yaw_rad=wrapped(pose.yaw_rad - origin.yaw_rad))
