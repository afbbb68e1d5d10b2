"""The simulated GraphNav service; its seed frame is the site's map."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

import grpc
from bosdyn.api import data_chunk_pb2, lease_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, graph_nav_service_pb2_grpc, map_pb2, nav_pb2

from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.body import Motors, WalkState
from recorders.spot.simulated.frames import height_of, kinematics, se3, stamp, yaw_of
from recorders.spot.simulated.graph_map import GraphMap, relative, shifted
from recorders.spot.simulated.robot import SimulatedState
from recorders.spot.simulated.services.commands import lasts_s
from workbench.worlds.geometry import Pose

Navigate = graph_nav_pb2.NavigateToRequest | graph_nav_pb2.NavigateToAnchorRequest
Upload = TypeVar(
    "Upload",
    graph_nav_pb2.UploadGraphStreamingRequest,
    graph_nav_pb2.UploadWaypointSnapshotRequest,
    graph_nav_pb2.UploadEdgeSnapshotRequest,
)


class GraphNav(graph_nav_service_pb2_grpc.GraphNavServiceServicer):
    """Localisation by fiducial, navigation on the site's map, upload and download of maps."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state
        self._map = GraphMap(state.site, state.fiducials)

    def GetLocalizationState(
        self, request: graph_nav_pb2.GetLocalizationStateRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.GetLocalizationStateResponse:
        """A lost robot still reports its last waypoint, as a Spot does."""
        with self._state.alive() as state:
            response = graph_nav_pb2.GetLocalizationStateResponse(header=header_of(state, request))
            response.robot_kinematics.CopyFrom(kinematics(state.body, state.clock.robot_ns()))
            response.lost_detector_state.is_lost = not state.localized and state.last_localization is not None
            if state.localized:
                state.last_localization = self._localization(state)
            if state.last_localization is not None:
                response.localization.CopyFrom(state.last_localization)
            return response

    def SetLocalization(
        self, request: graph_nav_pb2.SetLocalizationRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.SetLocalizationResponse:
        answer = graph_nav_pb2.SetLocalizationResponse
        with self._state.alive() as state:
            guess = request.initial_guess.waypoint_id
            if guess and guess not in self._map.waypoints:
                return answer(header=header_of(state, request), status=answer.STATUS_UNKNOWN_WAYPOINT)
            if request.fiducial_init == graph_nav_pb2.SetLocalizationRequest.FIDUCIAL_INIT_NO_FIDUCIAL and not guess:
                return answer(header=header_of(state, request), status=answer.STATUS_FAILED)
            fiducial = request.fiducial_init != graph_nav_pb2.SetLocalizationRequest.FIDUCIAL_INIT_NO_FIDUCIAL
            if not self._map.waypoints or (fiducial and not state.sees_fiducials):
                return answer(header=header_of(state, request), status=answer.STATUS_FAILED)
            state.localized = True
            return answer(
                header=header_of(state, request), status=answer.STATUS_OK, localization=self._localization(state)
            )

    def NavigateTo(
        self, request: graph_nav_pb2.NavigateToRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.NavigateToResponse:
        answer = graph_nav_pb2.NavigateToResponse
        with self._state.alive() as state:
            goal = self._map.waypoints.get(request.destination_waypoint_id)
            if goal is None:
                status = answer.STATUS_UNKNOWN_WAYPOINT
                return answer(
                    header=header_of(state, request), lease_use_results=_used(state, request), status=status
                )
            if request.HasField("destination_waypoint_tform_body_goal"):
                offset = request.destination_waypoint_tform_body_goal
                goal = shifted(goal, offset.position.x, offset.position.y, offset.angle)
            used = _used(state, request)
            status, number = self._set_off(state, request, goal, used)
            return answer(
                header=header_of(state, request),
                lease_use_results=used,
                status=answer.Status.Value(status),
                command_id=number,
            )

    def NavigateToAnchor(
        self, request: graph_nav_pb2.NavigateToAnchorRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.NavigateToAnchorResponse:
        answer = graph_nav_pb2.NavigateToAnchorResponse
        with self._state.alive() as state:
            goal = request.seed_tform_goal
            pose = Pose(x_m=goal.position.x, y_m=goal.position.y, yaw_rad=yaw_of(goal.rotation))
            used = _used(state, request)
            status, number = self._set_off(state, request, pose, used)
            return answer(
                header=header_of(state, request),
                lease_use_results=used,
                status=answer.Status.Value(status),
                command_id=number,
            )

    def NavigationFeedback(
        self, request: graph_nav_pb2.NavigationFeedbackRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.NavigationFeedbackResponse:
        with self._state.alive() as state:
            return _navigation_feedback(state, request)

    def DownloadGraph(
        self, request: graph_nav_pb2.DownloadGraphRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.DownloadGraphResponse:
        with self._state.alive() as state:
            return graph_nav_pb2.DownloadGraphResponse(header=header_of(state, request), graph=self._map.graph)

    def DownloadGraphStreaming(
        self, request: graph_nav_pb2.DownloadGraphRequest, context: grpc.ServicerContext
    ) -> Iterator[graph_nav_pb2.DownloadGraphStreamingResponse]:
        graph = self.DownloadGraph(request, context).SerializeToString()
        yield graph_nav_pb2.DownloadGraphStreamingResponse(
            header=header_of(self._state, request), chunk=_chunk(graph)
        )

    def DownloadWaypointSnapshot(
        self, request: graph_nav_pb2.DownloadWaypointSnapshotRequest, context: grpc.ServicerContext
    ) -> Iterator[graph_nav_pb2.DownloadWaypointSnapshotResponse]:
        name = request.waypoint_snapshot_id
        answer = graph_nav_pb2.DownloadWaypointSnapshotResponse
        data = self._map.snapshots.get(name) or map_pb2.WaypointSnapshot(id=name).SerializeToString()
        header = header_of(self._state, request)
        yield answer(header=header, status=answer.STATUS_OK, waypoint_snapshot_id=name, chunk=_chunk(data))

    def ClearGraph(
        self, request: graph_nav_pb2.ClearGraphRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.ClearGraphResponse:
        answer = graph_nav_pb2.ClearGraphResponse
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            if used.status == used.STATUS_OK:
                self._map.clear()
                state.localized, state.last_localization = False, None
            return answer(header=header_of(state, request), lease_use_result=used, status=answer.STATUS_OK)

    def UploadGraph(
        self, request: graph_nav_pb2.UploadGraphRequest, context: grpc.ServicerContext
    ) -> graph_nav_pb2.UploadGraphResponse:
        answer = graph_nav_pb2.UploadGraphResponse
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            if used.status == used.STATUS_OK:
                self._map.load(request.graph)
            return answer(
                header=header_of(state, request),
                lease_use_result=used,
                status=answer.STATUS_OK,
                unknown_waypoint_snapshot_ids=self._map.unknown_snapshots(request.graph),
            )

    def UploadGraphStreaming(
        self, request_iterator: Iterator[graph_nav_pb2.UploadGraphStreamingRequest], context: grpc.ServicerContext
    ) -> graph_nav_pb2.UploadGraphResponse:
        _, data = _joined(request_iterator)
        return self.UploadGraph(graph_nav_pb2.UploadGraphRequest.FromString(data), context)

    def UploadWaypointSnapshot(
        self, request_iterator: Iterator[graph_nav_pb2.UploadWaypointSnapshotRequest], context: grpc.ServicerContext
    ) -> graph_nav_pb2.UploadWaypointSnapshotResponse:
        answer = graph_nav_pb2.UploadWaypointSnapshotResponse
        first, data = _joined(request_iterator)
        with self._state.alive() as state:
            self._map.snapshots[map_pb2.WaypointSnapshot.FromString(data).id] = data
            return answer(header=header_of(state, first), status=answer.STATUS_OK)

    def UploadEdgeSnapshot(
        self, request_iterator: Iterator[graph_nav_pb2.UploadEdgeSnapshotRequest], context: grpc.ServicerContext
    ) -> graph_nav_pb2.UploadEdgeSnapshotResponse:
        first, _ = _joined(request_iterator)
        return graph_nav_pb2.UploadEdgeSnapshotResponse(header=header_of(self._state, first))

    def _set_off(
        self, state: SimulatedState, request: Navigate, goal: Pose, used: Sequence[lease_pb2.LeaseUseResult]
    ) -> tuple[str, int]:
        """Start or continue a walk; returns the status name (shared by both kinds of response) and the command id,
        0 if none."""
        lasts = lasts_s(state, request.end_time)
        if any(result.status != result.STATUS_OK for result in used) or not used:
            return "STATUS_OK", 0
        if not request.clock_identifier:
            return "STATUS_NO_TIMESYNC", 0
        if lasts <= 0:
            return "STATUS_EXPIRED", 0
        if state.body.motors is not Motors.ON:
            return "STATUS_ROBOT_IMPAIRED", 0
        if not state.localized:
            return "STATUS_NOT_LOCALIZED_TO_MAP", 0
        if request.command_id:
            walk = state.body.walk
            if walk is None or walk.number != request.command_id or walk.state is WalkState.EXPIRED:
                return "STATUS_UNRECOGNIZED_COMMAND", 0
            walk.end_s = state.body.lived_s + lasts
            return "STATUS_OK", walk.number
        limit = request.travel_params.velocity_limit.max_vel.linear.x or None
        turn = not request.travel_params.ignore_final_yaw
        number = state.walk_to(goal, speed_mps=limit, lasts_s=lasts, turn=turn)
        return ("STATUS_NO_PATH", 0) if number is None else ("STATUS_OK", number)

    def _localization(self, state: SimulatedState) -> nav_pb2.Localization:
        pose, height = state.body.pose, height_of(state.body)
        name = self._map.nearest(pose)
        local = relative(self._map.waypoints[name], pose)
        return nav_pb2.Localization(
            waypoint_id=name,
            waypoint_tform_body=se3(local.x_m, local.y_m, height, local.yaw_rad),
            seed_tform_body=se3(pose.x_m, pose.y_m, height, pose.yaw_rad),
            timestamp=stamp(state.clock.robot_ns()),
        )


def _chunk(data: bytes) -> data_chunk_pb2.DataChunk:
    return data_chunk_pb2.DataChunk(total_size=len(data), data=data)


def _joined(requests: Iterable[Upload]) -> tuple[Upload, bytes]:
    """The first request of a stream (for its header), and the joined data."""
    taken = list(requests)
    return taken[0], b"".join(request.chunk.data for request in taken)


def _used(state: SimulatedState, request: Navigate) -> list[lease_pb2.LeaseUseResult]:
    return [state.leases.use(lease) for lease in request.leases]


def _navigation_feedback(
    state: SimulatedState, request: graph_nav_pb2.NavigationFeedbackRequest
) -> graph_nav_pb2.NavigationFeedbackResponse:
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
    if state.navigation_status is not None:
        state.body.halt(WalkState.STOPPED)
        response.status = state.navigation_status
    if walk.state is WalkState.STUCK:
        response.stuck_reason = answer.STUCK_REASON_OBSTACLE
    return response
