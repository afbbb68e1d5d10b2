"""The simulated time-sync service: clock skew from round trips, as on the robot (TimeSyncService)."""

from __future__ import annotations

import threading
import uuid

import grpc
from bosdyn.api import time_sync_pb2, time_sync_service_pb2_grpc
from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.spot.client.time_source import SteppedClock
from recorders.spot.simulated.basic_services import header_of
from recorders.spot.simulated.frames import stamp
from recorders.spot.simulated.robot import SimulatedState
from workbench.log_schema.events import NANO

MIN_SAMPLES, KEPT_SAMPLES = 5, 50
"""Number of round trips before the estimate is valid, and number from which the best is chosen."""


class TimeSync(time_sync_service_pb2_grpc.TimeSyncServiceServicer):
    """Cristian's estimate from each round trip; the one of the shortest round trip is the best.

    Against a stepped clock only the last estimate is valid: the skew to a client's wall clock changes with every
    step.
    """

    def __init__(self, state: SimulatedState) -> None:
        self._state = state
        self._keep = 1 if isinstance(state.clock, SteppedClock) else KEPT_SAMPLES
        self._count: dict[str, int] = {}
        self._trips: dict[str, list[tuple[int, int]]] = {}
        self._lock = threading.Lock()

    def TimeSyncUpdate(
        self, request: time_sync_pb2.TimeSyncUpdateRequest, context: grpc.ServicerContext
    ) -> time_sync_pb2.TimeSyncUpdateResponse:
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
            if self._count.get(name, 0) >= MIN_SAMPLES:
                state.status = time_sync_pb2.TimeSyncState.STATUS_OK
            answer.state.CopyFrom(state)
        answer.header.CopyFrom(header_of(self._state, request, received))
        return answer

    def forget(self) -> None:
        """Discard all measurements after the clock was set."""
        with self._lock:
            self._trips.clear()
            self._count.clear()


def _ns(timestamp: Timestamp) -> int:
    return timestamp.seconds * NANO + timestamp.nanos


def _estimate(trip: time_sync_pb2.TimeSyncRoundTrip) -> tuple[int, int]:
    """(round trip, skew) of one exchange, nanoseconds."""
    t0, t1, t2, t3 = (_ns(t) for t in (trip.client_tx, trip.server_rx, trip.server_tx, trip.client_rx))
    return ((t3 - t0) - (t2 - t1), ((t1 - t0) + (t2 - t3)) // 2)


def _estimate_message(trip: tuple[int, int]) -> time_sync_pb2.TimeSyncEstimate:
    return time_sync_pb2.TimeSyncEstimate(round_trip_time=_duration(trip[0]), clock_skew=_duration(trip[1]))


def _duration(ns: int) -> Duration:
    sign = -1 if ns < 0 else 1
    return Duration(seconds=sign * (abs(ns) // NANO), nanos=sign * (abs(ns) % NANO))
