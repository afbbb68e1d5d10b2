"""Robot time: a time-sync thread that ended is noticed and started again, and stamps go by whole numbers."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("bosdyn.client")

from bosdyn.api import time_sync_pb2
from bosdyn.client.exceptions import RpcError
from bosdyn.client.time_sync import TimeSyncClient, TimeSyncThread
from hypothesis import given
from hypothesis import strategies as st

from recorders.foxglove.scene import timestamp
from recorders.spot.client import clock as clock_module
from recorders.spot.client.clock import STALE_NS, SyncedClock
from recorders.spot.simulated.frames import stamp
from workbench.log_schema.events import NANO


class Robot(TimeSyncClient):
    """A time-sync service whose clock is ahead by skew_s, and whose network may be away."""

    def __init__(self, skew_s: int) -> None:
        super().__init__()
        self.skew_s, self.away, self.asked = skew_s, False, 0

    def get_time_sync_update(
        self, previous_round_trip: object, clock_identifier: str, **_: object
    ) -> time_sync_pb2.TimeSyncUpdateResponse:
        self.asked += 1
        if self.away:
            raise RpcError(None, "away")
        answer = time_sync_pb2.TimeSyncUpdateResponse(clock_identifier="mine")
        answer.state.status = time_sync_pb2.TimeSyncState.STATUS_OK
        answer.state.best_estimate.clock_skew.seconds = self.skew_s
        answer.state.best_estimate.round_trip_time.nanos = 2_000_000
        return answer


def ended(thread: TimeSyncThread) -> bool:
    """Whether the thread ends within a minute."""
    deadline = time.monotonic() + 60
    while not thread.stopped and time.monotonic() < deadline:
        time.sleep(0.005)
    return thread.stopped


def synced(robot: Robot) -> tuple[SyncedClock, TimeSyncThread]:
    thread = TimeSyncThread(robot)
    thread.time_sync_interval_sec = 0.01
    thread.start()
    thread.wait_for_sync(timeout_sec=60)
    return SyncedClock(thread), thread


def test_a_time_sync_thread_that_an_error_ended_is_noticed_and_started_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(clock_module, "RESTART_S", 60.0)
    robot = Robot(3)
    clock, thread = synced(robot)
    try:
        assert (clock.skew_ns(), clock.round_trip_ns()) == (3 * NANO, 2_000_000)
        assert not clock.uncertain()
        robot.away = True
        assert ended(thread)
        robot.skew_s = 8
        assert clock.skew_ns() == 3 * NANO, "the endpoint goes on with the old skew"
        assert clock.uncertain()
        real, meanwhile = thread.start, list[bool]()
        monkeypatch.setattr(thread, "start", lambda: (real(), meanwhile.append(clock.uncertain())))
        clock.refresh()
        assert meanwhile == [True], "a thread that was just started again has measured nothing yet"
        assert clock.uncertain(), "the network is still away"
        robot.away = False
        clock.refresh()
        assert not clock.uncertain()
        assert clock.skew_ns() == 8 * NANO
        assert len(meanwhile) == 2
    finally:
        thread.stop()


def test_a_thread_that_runs_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, thread = synced(Robot(1))
    started = list[bool]()
    monkeypatch.setattr(thread, "start", lambda: started.append(True))
    try:
        clock.refresh()
        assert not started
    finally:
        thread.stop()


def test_a_skew_that_is_not_measured_again_becomes_uncertain() -> None:
    now = [0]
    thread = TimeSyncThread(Robot(1))
    thread.time_sync_interval_sec = 3600
    thread.start()
    try:
        thread.wait_for_sync(timeout_sec=60)
        clock = SyncedClock(thread, monotonic_ns=lambda: now[0])
        clock.skew_ns()
        now[0] = STALE_NS
        assert not clock.uncertain()
        now[0] += 1
        assert clock.uncertain()
    finally:
        thread.stop()


@given(st.integers(0, 4_000_000_000), st.integers(0, 200))
def test_stamps_just_below_a_full_second_stay_in_it(second: int, before_ns: int) -> None:
    """The SDK's nsec_to_timestamp is a second late there."""
    nanos = second * NANO + NANO - 1 - before_ns
    for made in (timestamp(nanos), stamp(nanos)):
        assert made.seconds * NANO + made.nanos == nanos
