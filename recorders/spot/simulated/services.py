"""Who is the robot, what time is it, who may command it? Directory, auth, time sync, leases, e-stop, power, notes."""

from __future__ import annotations

import secrets
import threading
import uuid
from typing import Any

from bosdyn.api import (
    auth_pb2,
    auth_service_pb2_grpc,
    data_buffer_pb2,
    data_buffer_service_pb2_grpc,
    directory_pb2,
    directory_service_pb2_grpc,
    estop_pb2,
    estop_service_pb2_grpc,
    header_pb2,
    lease_pb2,
    lease_service_pb2_grpc,
    power_pb2,
    power_service_pb2_grpc,
    robot_id_pb2,
    robot_id_service_pb2_grpc,
    time_sync_pb2,
    time_sync_service_pb2_grpc,
)
from google.protobuf.duration_pb2 import Duration

from recorders.spot.simulated.body import Motors, WalkState
from recorders.spot.simulated.clock import SteppedClock
from recorders.spot.simulated.frames import stamp
from recorders.spot.simulated.leases import PARTS, ROOT
from recorders.spot.simulated.robot import RobotState
from workbench.runs.vocabulary import NANO

ENOUGH_SAMPLES, KEPT_SAMPLES = 5, 50
"""Round trips before the time-sync estimate counts as good, and how many the best is chosen from."""

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
    "data-buffer": ("bosdyn.api.DataBufferService", "buffer.spot.robot"),
}
"""Per service name its type and its authority, as a Spot's directory lists them."""

OPEN_SERVICES = ("bosdyn.api.AuthService", "bosdyn.api.RobotIdService")
"""What may be asked without a token."""

AUTHORITIES = tuple(sorted({authority for _, authority in SERVICES.values()} | {"payload-registration.spot.robot"}))


def header_of(state: RobotState, request: Any, received_ns: int | None = None) -> header_pb2.ResponseHeader:
    """The response header that goes with a request: its header again, when it came, when it is answered."""
    now = state.clock.robot_ns()
    return header_pb2.ResponseHeader(
        request_header=request.header,
        request_received_timestamp=stamp(now if received_ns is None else received_ns),
        response_timestamp=stamp(now),
        error=header_pb2.CommonError(code=header_pb2.CommonError.CODE_OK),
    )


class Directory(directory_service_pb2_grpc.DirectoryServiceServicer):
    def __init__(self, state: RobotState) -> None:
        self._state = state

    def GetServiceEntry(self, request: Any, context: Any) -> Any:
        known = request.service_name in SERVICES
        answer = directory_pb2.GetServiceEntryResponse
        status = answer.STATUS_OK if known else answer.STATUS_NONEXISTENT_SERVICE
        entry = _entry(request.service_name) if known else None
        return answer(header=header_of(self._state, request), status=status, service_entry=entry)

    def ListServiceEntries(self, request: Any, context: Any) -> Any:
        return directory_pb2.ListServiceEntriesResponse(
            header=header_of(self._state, request), service_entries=[_entry(name) for name in SERVICES]
        )


def _entry(name: str) -> directory_pb2.ServiceEntry:
    kind, authority = SERVICES[name]
    return directory_pb2.ServiceEntry(
        name=name, type=kind, authority=authority, user_token_required=kind not in OPEN_SERVICES
    )


class Auth(auth_service_pb2_grpc.AuthServiceServicer):
    """Gives a token for the right name and password. Tokens are random; the interceptor asks for a known one."""

    def __init__(self, state: RobotState, username: str, password: str) -> None:
        self._state, self._username, self._password = state, username, password
        self.tokens: set[str] = set()

    def GetAuthToken(self, request: Any, context: Any) -> Any:
        answer = auth_pb2.GetAuthTokenResponse
        right = (request.username, request.password) == (self._username, self._password)
        if request.token:
            right = request.token in self.tokens
        if not right:
            status = answer.STATUS_INVALID_TOKEN if request.token else answer.STATUS_INVALID_LOGIN
            return answer(header=header_of(self._state, request), status=status)
        token = secrets.token_urlsafe(24)
        self.tokens.add(token)
        return answer(header=header_of(self._state, request), status=answer.STATUS_OK, token=token)


class RobotIdentity(robot_id_service_pb2_grpc.RobotIdServiceServicer):
    def __init__(self, state: RobotState) -> None:
        self._state = state

    def GetRobotId(self, request: Any, context: Any) -> Any:
        return robot_id_pb2.RobotIdResponse(
            header=header_of(self._state, request),
            robot_id=robot_id_pb2.RobotId(
                serial_number="simulated-spot",
                species="spot",
                version="V3",
                nickname=f"simulated at {self._state.site.name}",
                software_release=robot_id_pb2.RobotSoftwareRelease(
                    version=robot_id_pb2.SoftwareVersion(major_version=5, minor_version=0, patch_level=0),
                    name="simulated",
                    api_version="5.0.0",
                ),
            ),
        )


class TimeSync(time_sync_service_pb2_grpc.TimeSyncServiceServicer):
    """Cristian's estimate from each round trip; the one of the shortest round trip is the best.

    Against a stepped clock only the last one holds: the skew to a client's wall clock changes with every step.
    """

    def __init__(self, state: RobotState) -> None:
        self._state = state
        self._keep = 1 if isinstance(state.clock, SteppedClock) else KEPT_SAMPLES
        self._count: dict[str, int] = {}
        self._trips: dict[str, list[tuple[int, int]]] = {}
        self._lock = threading.Lock()

    def TimeSyncUpdate(self, request: Any, context: Any) -> Any:
        received = self._state.clock.robot_ns()
        with self._lock:
            name = request.clock_identifier or uuid.uuid4().hex
            trips = self._trips.setdefault(name, [])
            if request.HasField("previous_round_trip"):
                trips.append(_estimate(request.previous_round_trip))
                self._count[name] = self._count.get(name, 0) + 1
                del trips[: -self._keep]
            state = time_sync_pb2.TimeSyncState(status=time_sync_pb2.TimeSyncState.STATUS_MORE_SAMPLES_NEEDED)
            answer = time_sync_pb2.TimeSyncUpdateResponse(clock_identifier=name)
            if trips:
                answer.previous_estimate.CopyFrom(_estimate_message(trips[-1]))
                state.best_estimate.CopyFrom(_estimate_message(min(trips)))
                state.measurement_time.CopyFrom(stamp(received))
            if self._count.get(name, 0) >= ENOUGH_SAMPLES:
                state.status = time_sync_pb2.TimeSyncState.STATUS_OK
            answer.state.CopyFrom(state)
        answer.header.CopyFrom(header_of(self._state, request, received))
        return answer

    def forget(self) -> None:
        """Drops what was measured: the clock was set."""
        with self._lock:
            self._trips.clear()
            self._count.clear()


def _ns(timestamp: Any) -> int:
    return timestamp.seconds * NANO + timestamp.nanos


def _estimate(trip: Any) -> tuple[int, int]:
    """(round trip, skew) of one exchange, nanoseconds."""
    t0, t1, t2, t3 = (_ns(t) for t in (trip.client_tx, trip.server_rx, trip.server_tx, trip.client_rx))
    return ((t3 - t0) - (t2 - t1), ((t1 - t0) + (t2 - t3)) // 2)


def _estimate_message(trip: tuple[int, int]) -> time_sync_pb2.TimeSyncEstimate:
    return time_sync_pb2.TimeSyncEstimate(round_trip_time=_duration(trip[0]), clock_skew=_duration(trip[1]))


def _duration(ns: int) -> Duration:
    sign = -1 if ns < 0 else 1
    return Duration(seconds=sign * (abs(ns) // NANO), nanos=sign * (abs(ns) % NANO))


class Leases(lease_service_pb2_grpc.LeaseServiceServicer):
    def __init__(self, state: RobotState) -> None:
        self._state = state

    def AcquireLease(self, request: Any, context: Any) -> Any:
        answer = lease_pb2.AcquireLeaseResponse
        with self._state.alive() as state:
            if request.resource != ROOT:
                return answer(header=header_of(state, request), status=answer.STATUS_INVALID_RESOURCE)
            if not state.leases.is_free:
                status = answer.STATUS_RESOURCE_ALREADY_CLAIMED
                return answer(header=header_of(state, request), status=status, lease_owner=state.leases.owner)
            lease = state.leases.grant(request.header.client_name)
            owner = state.leases.owner
            return answer(header=header_of(state, request), status=answer.STATUS_OK, lease=lease, lease_owner=owner)

    def TakeLease(self, request: Any, context: Any) -> Any:
        answer = lease_pb2.TakeLeaseResponse
        with self._state.alive() as state:
            if request.resource != ROOT:
                return answer(header=header_of(state, request), status=answer.STATUS_INVALID_RESOURCE)
            state.body.halt(WalkState.NO_LEASE)
            lease = state.leases.grant(request.header.client_name)
            owner = state.leases.owner
            return answer(header=header_of(state, request), status=answer.STATUS_OK, lease=lease, lease_owner=owner)

    def ReturnLease(self, request: Any, context: Any) -> Any:
        answer = lease_pb2.ReturnLeaseResponse
        with self._state.alive() as state:
            returned = state.leases.give_back(request.lease)
            if returned:
                state.body.halt(WalkState.NO_LEASE)
            status = answer.STATUS_OK if returned else answer.STATUS_NOT_ACTIVE_LEASE
            return answer(header=header_of(state, request), status=status)

    def RetainLease(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            return lease_pb2.RetainLeaseResponse(header=header_of(state, request), lease_use_result=used)

    def ListLeases(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            book = state.leases
            resource = lease_pb2.LeaseResource(resource=ROOT, is_stale=book.owner is not None and book.is_free)
            if book.owner is not None:
                resource.lease_owner.CopyFrom(book.owner)
            if book.latest is not None:
                resource.lease.CopyFrom(book.latest)
            tree = lease_pb2.ResourceTree(
                resource=ROOT, sub_resources=[lease_pb2.ResourceTree(resource=part) for part in PARTS]
            )
            return lease_pb2.ListLeasesResponse(
                header=header_of(state, request), resources=[resource], resource_tree=tree
            )


class Estops(estop_service_pb2_grpc.EstopServiceServicer):
    def __init__(self, state: RobotState) -> None:
        self._state = state

    def RegisterEstopEndpoint(self, request: Any, context: Any) -> Any:
        answer = estop_pb2.RegisterEstopEndpointResponse
        with self._state.alive() as state:
            if request.target_config_id and request.target_config_id != state.estop.config_id:
                return answer(header=header_of(state, request), status=answer.STATUS_CONFIG_MISMATCH)
            wanted = estop_pb2.EstopEndpoint()
            wanted.CopyFrom(request.new_endpoint)
            wanted.unique_id = request.target_endpoint.unique_id or wanted.unique_id
            endpoint = state.estop.register(wanted)
            return answer(header=header_of(state, request), status=answer.STATUS_SUCCESS, new_endpoint=endpoint)

    def DeregisterEstopEndpoint(self, request: Any, context: Any) -> Any:
        answer = estop_pb2.DeregisterEstopEndpointResponse
        with self._state.alive() as state:
            if state.body.motors is not Motors.OFF:
                return answer(header=header_of(state, request), status=answer.STATUS_MOTORS_ON)
            gone = state.estop.deregister(request.target_endpoint.unique_id)
            status = answer.STATUS_SUCCESS if gone else answer.STATUS_ENDPOINT_MISMATCH
            return answer(header=header_of(state, request), status=status)

    def EstopCheckIn(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            status, challenge = state.estop.check_in(request)
            return estop_pb2.EstopCheckInResponse(
                header=header_of(state, request), request=request, challenge=challenge, status=status
            )

    def GetEstopConfig(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            config = state.estop.config()
            return estop_pb2.GetEstopConfigResponse(header=header_of(state, request), active_config=config)

    def SetEstopConfig(self, request: Any, context: Any) -> Any:
        answer = estop_pb2.SetEstopConfigResponse
        with self._state.alive() as state:
            if state.body.motors is not Motors.OFF:
                status, config = answer.STATUS_MOTORS_ON, state.estop.config()
            elif request.target_config_id and request.target_config_id != state.estop.config_id:
                status, config = answer.STATUS_INVALID_ID, state.estop.config()
            else:
                status, config = answer.STATUS_SUCCESS, state.estop.configure(request.config)
            return answer(header=header_of(state, request), status=status, active_config=config)

    def GetEstopSystemStatus(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            status = state.estop.status()
            return estop_pb2.GetEstopSystemStatusResponse(header=header_of(state, request), status=status)


class Power(power_service_pb2_grpc.PowerServiceServicer):
    def __init__(self, state: RobotState) -> None:
        self._state = state
        self._last = power_pb2.STATUS_SUCCESS

    def PowerCommand(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            used = state.leases.use(request.lease)
            answer = power_pb2.PowerCommandResponse(header=header_of(state, request), lease_use_result=used)
            if used.status != used.STATUS_OK:
                return answer
            answer.power_command_id = state.number("power")
            if request.request == power_pb2.PowerCommandRequest.REQUEST_OFF:
                state.body.power_off()
                answer.status = power_pb2.STATUS_SUCCESS
            elif request.request != power_pb2.PowerCommandRequest.REQUEST_ON:
                answer.status = power_pb2.STATUS_INTERNAL_ERROR
            elif state.estop.stopped:
                answer.status = power_pb2.STATUS_ESTOPPED
            else:
                state.body.power_on()
                answer.status = power_pb2.STATUS_IN_PROGRESS
            return answer

    def PowerCommandFeedback(self, request: Any, context: Any) -> Any:
        with self._state.alive() as state:
            status = {
                Motors.ON: power_pb2.STATUS_SUCCESS,
                Motors.POWERING_ON: power_pb2.STATUS_IN_PROGRESS,
                Motors.OFF: power_pb2.STATUS_ESTOPPED if state.estop.stopped else power_pb2.STATUS_SUCCESS,
            }[state.body.motors]
            return power_pb2.PowerCommandFeedbackResponse(header=header_of(state, request), status=status)


class DataBuffer(data_buffer_service_pb2_grpc.DataBufferServiceServicer):
    """Takes comments and events, as the robot's own log does."""

    def __init__(self, state: RobotState) -> None:
        self._state = state

    def RecordOperatorComments(self, request: Any, context: Any) -> Any:
        self._state.comments.extend(comment.message for comment in request.operator_comments)
        return data_buffer_pb2.RecordOperatorCommentsResponse(header=header_of(self._state, request))

    def RecordTextMessages(self, request: Any, context: Any) -> Any:
        return data_buffer_pb2.RecordTextMessagesResponse(header=header_of(self._state, request))

    def RecordEvents(self, request: Any, context: Any) -> Any:
        return data_buffer_pb2.RecordEventsResponse(header=header_of(self._state, request))

    def RecordDataBlobs(self, request: Any, context: Any) -> Any:
        return data_buffer_pb2.RecordDataBlobsResponse(header=header_of(self._state, request))
