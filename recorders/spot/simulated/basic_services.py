"""The simulated directory, auth, robot-id and data-buffer services."""

from __future__ import annotations

import secrets
from typing import Protocol

import grpc
from bosdyn.api import (
    auth_pb2,
    auth_service_pb2_grpc,
    data_buffer_pb2,
    data_buffer_service_pb2_grpc,
    directory_pb2,
    directory_service_pb2_grpc,
    header_pb2,
    robot_id_pb2,
    robot_id_service_pb2_grpc,
)

from recorders.spot.simulated.frames import stamp
from recorders.spot.simulated.robot import SimulatedState

SERVICES = {
    "directory": ("bosdyn.api.DirectoryService", "api.spot.robot"),
    "auth": ("bosdyn.api.AuthService", "auth.spot.robot"),
    "robot-id": ("bosdyn.api.RobotIdService", "id.spot.robot"),
    "time-sync": ("bosdyn.api.TimeSyncService", "timesync.spot.robot"),
    "lease": ("bosdyn.api.LeaseService", "lease.spot.robot"),
    "estop": ("bosdyn.api.EstopService", "estop.spot.robot"),
    "power": ("bosdyn.api.PowerService", "power.spot.robot"),
    "robot-state": ("bosdyn.api.RobotStateService", "state.spot.robot"),
    "robot-command": ("bosdyn.api.RobotCommandService", "command.spot.robot"),
    "graph-nav-service": ("bosdyn.api.graph_nav.GraphNavService", "graph-nav.spot.robot"),
    "world-objects": ("bosdyn.api.WorldObjectService", "world-objects.spot.robot"),
    "image": ("bosdyn.api.ImageService", "camera.spot.robot"),
    "local-grid-service": ("bosdyn.api.LocalGridService", "localgrid.spot.robot"),
    "manipulation": ("bosdyn.api.ManipulationApiService", "manipulation.spot.robot"),
    "docking": ("bosdyn.api.docking.DockingService", "docking.spot.robot"),
    "license": ("bosdyn.api.LicenseService", "license.spot.robot"),
    "data-buffer": ("bosdyn.api.DataBufferService", "buffer.spot.robot"),
}
"""Type and authority of each service by name, as in a Spot's directory."""

OPEN_SERVICES = ("bosdyn.api.AuthService", "bosdyn.api.RobotIdService")
"""Services that need no token."""

AUTHORITIES = tuple(sorted({authority for _, authority in SERVICES.values()} | {"payload-registration.spot.robot"}))


LOCKED_AFTER = 4


class Request(Protocol):
    """Any request with a header."""

    @property
    def header(self) -> header_pb2.RequestHeader: ...


def header_of(state: SimulatedState, request: Request, received_ns: int | None = None) -> header_pb2.ResponseHeader:
    """The response header for a request: the request's header with times of receipt and response."""
    now = state.clock.robot_ns()
    return header_pb2.ResponseHeader(
        request_header=request.header,
        request_received_timestamp=stamp(now if received_ns is None else received_ns),
        response_timestamp=stamp(now),
        error=header_pb2.CommonError(code=header_pb2.CommonError.CODE_OK),
    )


class Directory(directory_service_pb2_grpc.DirectoryServiceServicer):
    """The directory service: which services the robot has, and where."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def GetServiceEntry(
        self, request: directory_pb2.GetServiceEntryRequest, context: grpc.ServicerContext
    ) -> directory_pb2.GetServiceEntryResponse:
        known = request.service_name in SERVICES
        answer = directory_pb2.GetServiceEntryResponse
        status = answer.STATUS_OK if known else answer.STATUS_NONEXISTENT_SERVICE
        entry = _entry(request.service_name) if known else None
        return answer(header=header_of(self._state, request), status=status, service_entry=entry)

    def ListServiceEntries(
        self, request: directory_pb2.ListServiceEntriesRequest, context: grpc.ServicerContext
    ) -> directory_pb2.ListServiceEntriesResponse:
        return directory_pb2.ListServiceEntriesResponse(
            header=header_of(self._state, request), service_entries=[_entry(name) for name in SERVICES]
        )


def _entry(name: str) -> directory_pb2.ServiceEntry:
    kind, authority = SERVICES[name]
    return directory_pb2.ServiceEntry(
        name=name, type=kind, authority=authority, user_token_required=kind not in OPEN_SERVICES
    )


class Auth(auth_service_pb2_grpc.AuthServiceServicer):
    """Issues a random token for valid credentials, which the interceptor then requires."""

    def __init__(self, state: SimulatedState, username: str, password: str) -> None:
        self._state, self._username, self._password = state, username, password
        self.tokens: set[str] = set()
        self.wrong = 0
        """Number of wrong logins in a row; after LOCKED_AFTER of them the user is locked out."""

    def GetAuthToken(
        self, request: auth_pb2.GetAuthTokenRequest, context: grpc.ServicerContext
    ) -> auth_pb2.GetAuthTokenResponse:
        answer = auth_pb2.GetAuthTokenResponse
        right = (request.username, request.password) == (self._username, self._password)
        if request.token:
            right = request.token in self.tokens
        self.wrong = 0 if right and self.wrong < LOCKED_AFTER else self.wrong + 1
        if self.wrong > LOCKED_AFTER:
            return answer(header=header_of(self._state, request), status=answer.STATUS_TEMPORARILY_LOCKED_OUT)
        if not right:
            status = answer.STATUS_INVALID_TOKEN if request.token else answer.STATUS_INVALID_LOGIN
            return answer(header=header_of(self._state, request), status=status)
        token = secrets.token_urlsafe(24)
        self.tokens.add(token)
        return answer(header=header_of(self._state, request), status=answer.STATUS_OK, token=token)


class RobotIdentity(robot_id_service_pb2_grpc.RobotIdServiceServicer):
    """The robot-id service: serial number, software release and name."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def GetRobotId(
        self, request: robot_id_pb2.RobotIdRequest, context: grpc.ServicerContext
    ) -> robot_id_pb2.RobotIdResponse:
        return robot_id_pb2.RobotIdResponse(
            header=header_of(self._state, request),
            robot_id=robot_id_pb2.RobotId(
                serial_number="simulated-spot",
                species="spot",
                version="V3",
                nickname=f"simulated at {self._state.site.name}",
                software_release=robot_id_pb2.RobotSoftwareRelease(
                    version=robot_id_pb2.SoftwareVersion(
                        major_version=self._state.software.major,
                        minor_version=self._state.software.minor,
                        patch_level=self._state.software.patch,
                    ),
                    name="simulated",
                    api_version=str(self._state.software),
                ),
            ),
        )


class DataBuffer(data_buffer_service_pb2_grpc.DataBufferServiceServicer):
    """Accepts comments and events, as the robot's log does."""

    def __init__(self, state: SimulatedState) -> None:
        self._state = state

    def RecordOperatorComments(
        self, request: data_buffer_pb2.RecordOperatorCommentsRequest, context: grpc.ServicerContext
    ) -> data_buffer_pb2.RecordOperatorCommentsResponse:
        self._state.comments.extend(comment.message for comment in request.operator_comments)
        return data_buffer_pb2.RecordOperatorCommentsResponse(header=header_of(self._state, request))

    def RecordTextMessages(
        self, request: data_buffer_pb2.RecordTextMessagesRequest, context: grpc.ServicerContext
    ) -> data_buffer_pb2.RecordTextMessagesResponse:
        return data_buffer_pb2.RecordTextMessagesResponse(header=header_of(self._state, request))

    def RecordEvents(
        self, request: data_buffer_pb2.RecordEventsRequest, context: grpc.ServicerContext
    ) -> data_buffer_pb2.RecordEventsResponse:
        return data_buffer_pb2.RecordEventsResponse(header=header_of(self._state, request))

    def RecordDataBlobs(
        self, request: data_buffer_pb2.RecordDataBlobsRequest, context: grpc.ServicerContext
    ) -> data_buffer_pb2.RecordDataBlobsResponse:
        return data_buffer_pb2.RecordDataBlobsResponse(header=header_of(self._state, request))
