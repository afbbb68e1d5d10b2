"""Sessions recorded from a robot in real time: nothing lost, both clocks kept, gaps marked, no secrets."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import grpc
import msgspec
import pytest
from bosdyn.api import robot_state_pb2
from bosdyn.api.graph_nav import nav_pb2
from bosdyn.api.time_sync_pb2 import TimeSyncUpdateRequest, TimeSyncUpdateResponse
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap.reader import make_reader
from spot_help import messages, robot

from recorders.spot.client import connection as connection_module
from recorders.spot.client.clock import SessionClock
from recorders.spot.client.time_source import RunningClock
from recorders.spot.record_session import SessionEnd, SessionPlan, record_session
from recorders.spot.run.operator import StopSwitch
from recorders.spot.run.site_tasks import delivery_of, site_task
from recorders.spot.session.session import Rates
from recorders.spot.session.topics import ClockSkew, Gap, Note, RobotStatus
from recorders.spot.simulated.faults import FaultKind
from recorders.spot.simulated.sensing import State
from recorders.spot.simulated.services.server import SimulatedSpot
from recorders.spot.simulated.services.time_sync import TimeSync
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.execution.events import RunStatus
from workbench.log_schema.events import NANO
from workbench.worlds.sites.site import load_site

QUICK = Rates(
    state_hz=20.0, localization_hz=10.0, fiducials_hz=5.0, images_hz=10.0, grid_hz=2.0, clock_hz=2.0, image_ratio=0.25
)


def plan(for_s: float, rates: Rates = QUICK) -> SessionPlan:
    home = load_site("paper_home")
    return SessionPlan(site=home, task=site_task(delivery_of(home), home), rates=rates, for_s=for_s)


def test_every_answer_is_in_the_log(tmp_path: Path) -> None:
    with robot(clock=RunningClock()) as (_spot, connection):
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization())
        report = record_session(connection, plan(2.0), tmp_path / "s.mcap")
    assert report.dropped == {}
    count: dict[str, int] = {}
    for topic, *_ in messages(tmp_path / "s.mcap"):
        count[topic] = count.get(topic, 0) + 1
    assert count["/spot/robot_state"] == count["/robot/odometry"] == report.taken["state"]
    assert count["/tf"] == report.taken["state"] + 2 * report.taken["images"], "and where each of two cameras sat"
    assert count["/camera/frontleft_fisheye"] == count["/spot/image/frontleft_fisheye"] == report.taken["images"]
    assert count["/spot/localization"] == count["/robot/pose"] == report.taken["localization"]
    assert count["/spot/world_objects"] == report.taken["fiducials"]
    assert count["/robot/local_grid"] == report.taken["grid"]
    assert count["/robot/clock"] == report.taken["clock"]
    assert report.taken["state"] >= 10


def within(facts: list[ClockSkew]) -> int:
    """5 ms; on a machine that is so busy that round trips take longer, half of the longest: no more can be known."""
    return max(5_000_000, *(fact.round_trip_ns // 2 + 100_000 for fact in facts))


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("skew_s", [-3600.0, 0.75])
def test_a_skewed_robot_clock_ends_up_within_5_ms(skew_s: float, tmp_path: Path) -> None:
    """publish_time is our time of the robot's stamp; the robot's own stamp stays in its message."""
    with robot(clock=RunningClock(skew_s=skew_s)) as (_spot, connection):
        record_session(connection, plan(1.5), tmp_path / "s.mcap")
    states = messages(tmp_path / "s.mcap", "/spot/robot_state")
    facts = [msgspec.json.decode(d, type=ClockSkew) for *_, d in messages(tmp_path / "s.mcap", "/robot/clock")]
    allowed_ns = within(facts)
    assert len(states) >= 5
    for _, log_time, publish_time, data in states:
        stamp = robot_state_pb2.RobotState.FromString(data).kinematic_state.acquisition_timestamp
        robot_ns = stamp.seconds * NANO + stamp.nanos
        true_ns = robot_ns - round(skew_s * NANO)
        assert abs(publish_time - true_ns) < allowed_ns
        assert log_time >= true_ns
    assert all(abs(fact.skew_ns - skew_s * NANO) < allowed_ns for fact in facts)


def apply_fault(spot: SimulatedSpot, kind: FaultKind, for_s: float, over_ns: list[int]) -> None:
    """A fault now; when it is over is added to over_ns."""
    over_ns.append(time.time_ns() + round(for_s * NANO))
    if kind is FaultKind.DROPPED:
        spot.drop(for_s)
    else:
        spot.inject(kind, 2.5 if kind is FaultKind.CLOCK_SKEW else for_s)


OFTEN = (FaultKind.DROPPED, FaultKind.CLOCK_SKEW, FaultKind.LOST_LEASE)


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("kind", [k if k in OFTEN else pytest.param(k, marks=pytest.mark.slow) for k in FaultKind])
def test_failures_while_recording_leave_the_log_whole(
    kind: FaultKind, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, over_ns, ending, states_sent = tmp_path / "s.mcap", list[int](), SessionEnd(), count_states(monkeypatch)

    def fail_and_recover() -> None:
        wait_until(lambda: states_sent() >= 5)
        apply_fault(spot, kind, 1.5, over_ns)
        wait_until(lambda: time.time_ns() > over_ns[0])
        wait_for_more(states_sent, 10)
        ending.by_key("q")

    with robot(clock=RunningClock()) as (spot, connection):
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization())
        threading.Thread(target=fail_and_recover).start()
        report = record_session(connection, plan(200.0), log, ending=ending)
        assert spot.state.leases.owner is None or spot.state.leases.owner.client_name == "another-client"
    run = read(log)
    assert run.complete
    assert run.outcome is not None
    assert report.dropped == {}
    stamps = [log_time for _, log_time, _, _ in messages(log, "/spot/robot_state")]
    assert max(stamps) > over_ns[0], "recording goes on after the failure"
    if kind is FaultKind.DROPPED:
        gaps = [msgspec.json.decode(d, type=Gap) for *_, d in messages(log, "/session/gap")]
        assert len(gaps) == len(report.gaps_s) >= 1
        assert sum(gap.seconds for gap in gaps) > 0.5
        assert gaps[-1].end.ns <= max(stamps), "it ends with the outage"
    if kind in (FaultKind.STUCK, FaultKind.LOST_LOCALIZATION, FaultKind.ESTOP):
        told = [msgspec.json.decode(d, type=RobotStatus) for *_, d in messages(log, "/robot/status")]
        assert any(status.faults or status.estopped for status in told)


def count_states(monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """How many of its states the simulated robot has sent so far."""
    sent, real = list[None](), State.GetRobotState

    def answer(self: State, request: Any, context: Any) -> Any:
        sent.append(None)
        return real(self, request, context)

    monkeypatch.setattr(State, "GetRobotState", answer)
    return sent.__len__


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 100
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


def wait_for_more(count: Callable[[], int], more: int) -> None:
    enough = count() + more
    wait_until(lambda: count() >= enough)


@pytest.mark.ci
def test_messages_of_a_gap_of_the_time_sync_are_marked_one_by_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only the time-sync service is away, for a while; every other answer comes as before."""
    away, real = threading.Event(), TimeSync.TimeSyncUpdate

    def answer(
        self: TimeSync, request: TimeSyncUpdateRequest, context: grpc.ServicerContext
    ) -> TimeSyncUpdateResponse:
        if away.is_set():
            context.abort(grpc.StatusCode.UNAVAILABLE, "no time sync")
        return real(self, request, context)

    monkeypatch.setattr(TimeSync, "TimeSyncUpdate", answer)
    monkeypatch.setattr(connection_module, "TIME_SYNC_EVERY_S", 0.05)
    states_sent, ending = count_states(monkeypatch), SessionEnd()

    def come_and_go(clock: SessionClock) -> None:
        wait_until(lambda: states_sent() >= 5)
        away.set()
        wait_until(clock.uncertain)
        wait_for_more(states_sent, 8)
        away.clear()
        wait_until(lambda: not clock.uncertain())
        wait_for_more(states_sent, 5)
        ending.by_key("q")

    log = tmp_path / "s.mcap"
    with robot(clock=RunningClock(skew_s=7.0)) as (_spot, connection):
        threading.Thread(target=come_and_go, args=(connection.clock,)).start()
        record_session(connection, plan(200.0, replace(QUICK, clock_hz=10.0)), log, ending=ending)
    with log.open("rb") as stream:
        found = [
            (c, m) for _, c, m in make_reader(stream).iter_messages(topics=["/spot/robot_state", "/robot/clock"])
        ]
    states = [
        (m.log_time, c.metadata.get("lios.stamps") == "uncertain") for c, m in found if c.topic != "/robot/clock"
    ]
    marks = [mark for _, mark in states]
    assert sum(a != b for a, b in pairwise(marks)) == 2, "certain, uncertain, certain again"
    assert not marks[0]
    assert not marks[-1]
    gap = [at for at, mark in states if mark]
    assert len(gap) >= 5
    skews = [(m.log_time, msgspec.json.decode(m.data, type=ClockSkew)) for c, m in found if c.topic == "/robot/clock"]
    assert [fact.uncertain for at, fact in skews if gap[0] < at < gap[-1]].count(False) <= 1
    allowed_ns = within([fact for _, fact in skews])
    assert all(abs(fact.skew_ns - 7 * NANO) < allowed_ns for _, fact in skews), "the last skew is kept"
    assert lios(["doctor", str(log)]) == 0
    assert "/spot/robot_state" in capsys.readouterr().out
    assert read(log).complete


def test_notes_and_the_outcome_come_by_key(tmp_path: Path) -> None:
    ending = SessionEnd()
    with robot(clock=RunningClock()) as (_spot, connection):
        threading.Timer(0.5, ending.by_key, args=("f",)).start()
        report = record_session(connection, plan(200.0), tmp_path / "s.mcap", ending=ending)
    assert report.ended.status is RunStatus.ABORTED
    assert report.ended.reason == "the operator says that it failed"
    assert report.seconds < 100


def test_a_note_is_in_the_log_and_in_the_words(tmp_path: Path) -> None:
    from recorders.sinks.files import LogFiles
    from recorders.spot.session.session import Session

    with robot() as (spot, connection):
        files = LogFiles(tmp_path / "s.mcap")
        session = Session(connection, spot.state.site, files)
        session.note("somebody moved the table")
        session.tick()
        files.close()
    notes = [msgspec.json.decode(d, type=Note).text for *_, d in messages(tmp_path / "s.mcap", "/session/note")]
    assert notes == ["somebody moved the table"]
    assert len(messages(tmp_path / "s.mcap", "/log")) >= 1
    picture = CompressedImage.FromString(messages(tmp_path / "s.mcap", "/camera/frontleft_fisheye")[0][3])
    assert picture.format == "jpeg"
    assert picture.data.startswith(b"\xff\xd8")


def test_nothing_secret_is_in_a_log(tmp_path: Path) -> None:
    with robot(password="open-sesame-42") as (spot, connection):
        from recorders.sinks.files import LogFiles
        from recorders.spot.session.session import Session

        files = LogFiles(tmp_path / "s.mcap", compression="")
        session = Session(connection, spot.state.site, files)
        for _ in range(20):
            connection.clock.sleep(0.5)
            session.tick()
        files.close()
        token = str(connection.robot.user_token)
    held = (tmp_path / "s.mcap").read_bytes()
    assert b"simulated-spot" not in token.encode()
    assert len(token) > 20
    assert token.encode() not in held
    assert b"open-sesame-42" not in held


@pytest.mark.ci
def test_a_slow_camera_does_not_hold_up_the_odometry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import recorders.spot.simulated.services.images as images

    quick = images.draw

    def slow(*args: object, **kwargs: object) -> object:
        time.sleep(0.3)
        return quick(*args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(images, "draw", slow)
    with robot(clock=RunningClock()) as (_spot, connection):
        report = record_session(connection, plan(2.5), tmp_path / "s.mcap")
    assert report.taken["images"] <= 6
    assert report.skipped["images"] >= 5
    assert report.taken["state"] >= 3 * report.taken["images"]


def test_a_stopped_recording_is_closed_properly(tmp_path: Path) -> None:
    stop = StopSwitch()
    stop.press("once")
    stop.press("twice")
    assert stop.reason == "once"
    with robot(clock=RunningClock()) as (_spot, connection):
        record_session(connection, plan(0.3), tmp_path / "s.mcap")
    assert read(tmp_path / "s.mcap").complete
