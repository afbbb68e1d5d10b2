"""Recording of a robot session: each sensor stream is polled at its own rate and written to a sink.

Each stream has its own thread, so that a slow camera does not delay odometry; writing to the sink never blocks. If
the network goes down, every thread retries until it is back, and the gap is recorded from the last answer of any
stream to the next one. If only one stream fails while others work, its error is reported once and counted.
`log_time` is the time of receipt, `publish_time` the robot's stamp converted by time sync; messages whose stamps were
converted while time sync was away are in separate channels (topics.py).
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol, Self

import msgspec
from bosdyn.client.exceptions import RpcError, UnauthenticatedError
from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.message import Message

from recorders.foxglove import scene as viewer
from recorders.mcap_io.channels import protobuf_channel
from recorders.sinks.files import Sink
from recorders.spot.client.connection import ROBOT_ERRORS, Connection, reason_of
from recorders.spot.session import foxglove
from recorders.spot.session.live_status import LiveStatus
from recorders.spot.session.sensor_pollers import SensorStream, sensor_streams
from recorders.spot.session.topics import NOTE_EVENTS, Gap, Note, SessionFact, SessionStatus, fact_channel
from workbench.errors import InputError, LiosError
from workbench.log_schema.events import Stamp
from workbench.worlds.geometry import Point
from workbench.worlds.sites.site import Site

RETRY_S = 0.3
GAP_S = 0.5
"""Shortest time in seconds without any answer that counts as a gap."""

log = logging.getLogger("lios.spot")


@dataclass(frozen=True, slots=True, kw_only=True)
class Rates:
    """Polling rates of the streams in Hz; 0 turns a stream off."""

    state_hz: float = 10.0
    localization_hz: float = 5.0
    fiducials_hz: float = 4.0
    tags_hz: float = 2.0
    images_hz: float = 2.0
    grid_hz: float = 1.0
    clock_hz: float = 0.2
    status_hz: float = 1.0
    cameras: tuple[str, ...] = ("frontleft_fisheye_image", "frontright_fisheye_image")
    image_quality: int = 75
    image_ratio: float = 1.0
    raw: bool = True
    """Also record bosdyn's original messages."""


@dataclass(slots=True)
class _ConnectionState:
    """Connection state shared by all streams.

    Attributes:
        answered_ns: time of the last answer to any stream. since_ns: start of the current outage; None while
            connected.
        reported: whether the outage has been reported.
    """

    answered_ns: int = 0
    since_ns: int | None = None
    reason: str = ""
    reported: bool = False
    lock: threading.Lock = field(default_factory=threading.Lock)


class SensorListener(Protocol):
    """A listener to sensor data, called from several threads, that derives the robot's actions."""

    def pose(self, stamp_ns: int, point: Point) -> None: ...

    def tag(self, stamp_ns: int, number: int, position: tuple[float, float, float]) -> None: ...

    def holding(self, stamp_ns: int, holds: bool) -> None: ...


class Session:
    """Records the sensor streams of a robot. A context manager with threads, or stepped by `tick`.

    Args:
        connection: the robot. site: its site.
        sink: the output.
        rates: polling rates.

    Attributes:
        taken: answers per stream. skipped: polls skipped because the previous one was still running.
        failed: failed polls per stream. troubles: error of each stream that fails while others work.
        gaps: durations of outages in seconds.
        live: the last reports of the streams. show_status: called with each status message.
    """

    def __init__(self, connection: Connection, site: Site, sink: Sink, *, rates: Rates | None = None) -> None:
        self.connection, self.site, self.sink = connection, site, sink
        self.rates = rates or Rates()
        self.taken: dict[str, int] = {}
        self.skipped: dict[str, int] = {}
        self.failed: dict[str, int] = {}
        self.troubles: dict[str, str] = {}
        self._failing_ns: dict[str, int] = {}
        self.gaps: list[float] = []
        self.watch: SensorListener | None = None
        self.live = LiveStatus()
        self.show_status: Callable[[SessionStatus], None] | None = None
        self._away = _ConnectionState()
        self._closing = threading.Event()
        self._login = threading.Lock()
        self._refused_login = False
        self._threads: list[threading.Thread] = []
        self._senses = sensor_streams(self)
        self._due: dict[str, int] = {}

    def __enter__(self) -> Self:
        for sense in self._senses:
            thread = threading.Thread(target=self._work, args=(sense,), name=f"lios-{sense.name}", daemon=True)
            self._threads.append(thread)
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        for thread in self._threads:
            thread.join(timeout=2 * self.connection.timeout_s)
        if self._away.since_ns is not None:
            self._found(back=False)

    def tick(self) -> None:
        """Poll every stream that is due; for a stepped clock, without threads."""
        now = self.now_ns()
        for sense in self._senses:
            if now >= self._due.get(sense.name, 0):
                self._due[sense.name] = now + round(sense.period_s * 1e9)
                self._ask(sense)

    def now_ns(self) -> int:
        return self.connection.clock.now_ns()

    def put(
        self, topic: str, message: Message, *, source_ns: int, latched: bool = False, by_robot: bool = True
    ) -> None:
        """Write a protobuf message received now and stamped source_ns in our time.

        Args:
            by_robot: source_ns was converted from the robot's time; while its skew is old, the message goes to the
                topic's channel for uncertain stamps.
        """
        uncertain = by_robot and self.connection.clock.uncertain()
        channel = protobuf_channel(topic, type(message), latched=latched, uncertain=uncertain)
        self.sink.write(
            channel, message.SerializeToString(deterministic=True), log_time=self.now_ns(), publish_time=source_ns
        )

    def report_status(self) -> None:
        """Write the session's status, and show it."""
        status = self.live.now(self.now_ns(), answered_ns=self._away.answered_ns, sink=self.sink)
        self.tell(status)
        if self.show_status is not None:
            self.show_status(status)

    def tell(self, fact: SessionFact) -> None:
        """Write one of our JSON messages."""
        known = {name: value for name, value in msgspec.structs.asdict(fact).items() if value is not None}
        self.sink.write(fact_channel(type(fact)), msgspec.json.encode(known), log_time=self.now_ns())

    def note(self, text: str, *, at_ns: int | None = None) -> None:
        """Write an operator's note: as JSON, as the event that `lios log note` writes, and as a log message."""
        at_ns = self.now_ns() if at_ns is None else at_ns
        self.tell(Note(stamp=Stamp.of(at_ns), text=text))
        self.put(NOTE_EVENTS, foxglove.note_event(text, at_ns), source_ns=at_ns, by_robot=False)
        self.words(f"Note: {text}")

    def words(self, text: str, *, level: Log.Level.ValueType = Log.INFO) -> None:
        now = self.now_ns()
        self.put("/log", viewer.words(text, now, level=level, name="spot"), source_ns=now, by_robot=False)

    def _work(self, sense: SensorStream) -> None:
        """Poll a stream at its rate until the session ends."""
        began, turn = time.monotonic(), 0
        while not self._closing.is_set():
            self._ask(sense)
            turn += 1
            due = began + turn * sense.period_s
            now = time.monotonic()
            if now > due + sense.period_s:
                missed = int((now - due) / sense.period_s)
                self.skipped[sense.name] = self.skipped.get(sense.name, 0) + missed
                turn += missed
                due = began + turn * sense.period_s
            self._closing.wait(max(0.0, due - now))

    def _ask(self, sense: SensorStream) -> None:
        try:
            sense.take()
        except UnauthenticatedError as error:
            self._lost(sense, error)
            self._log_in_again()
        except RpcError as error:
            self._lost(sense, error)
            self._closing.wait(RETRY_S)
        except ROBOT_ERRORS as error:
            self._answered()
            self._refused(sense, error)
        else:
            self.taken[sense.name] = self.taken.get(sense.name, 0) + 1
            self._failing_ns.pop(sense.name, None)
            self.troubles.pop(sense.name, None)
            if sense.asks_robot:
                self._answered()

    def _answered(self) -> None:
        self._away.answered_ns = self.now_ns()
        if self._away.since_ns is not None:
            self._found()

    def _refused(self, sense: SensorStream, error: Exception) -> None:
        """Count a failed stream, and report each new reason once."""
        self.failed[sense.name] = self.failed.get(sense.name, 0) + 1
        reason = reason_of(error)
        if self.troubles.get(sense.name) != reason:
            self.troubles[sense.name] = reason
            self.words(f"The robot gives no {sense.name} ({reason})", level=Log.WARNING)

    def _lost(self, sense: SensorStream, error: Exception) -> None:
        """Handle a missing answer: the robot is unreachable or, if other streams work, only this stream fails."""
        now, away = self.now_ns(), self._away
        if away.answered_ns > self._failing_ns.setdefault(sense.name, now):
            self._refused(sense, error)
            return
        self.failed[sense.name] = self.failed.get(sense.name, 0) + 1
        with away.lock:
            if away.since_ns is None:
                away.since_ns, away.reason, away.reported = away.answered_ns or now, reason_of(error), False
            if not away.reported and now - away.since_ns > GAP_S * 1e9:
                away.reported = True
                self.words(f"The robot does not answer ({away.reason})", level=Log.WARNING)

    def _found(self, *, back: bool = True) -> None:
        """Record the gap when the robot answers again or the session ends."""
        away = self._away
        with away.lock:
            start_ns, away.since_ns = away.since_ns, None
            end_ns = self.now_ns()
            if start_ns is None or end_ns - start_ns < GAP_S * 1e9:
                return
            seconds = (end_ns - start_ns) / 1e9
            self._failing_ns.clear()
            self.gaps.append(seconds)
            self.tell(
                Gap(
                    stamp=Stamp.of(end_ns),
                    start=Stamp.of(start_ns),
                    end=Stamp.of(end_ns),
                    seconds=seconds,
                    reason=away.reason,
                )
            )
            if back:
                self.words(f"The robot answers again after {seconds:.1f} s", level=Log.WARNING)

    def _log_in_again(self) -> None:
        """Log in again; one thread at a time, and not again once the robot refused the login, which would lock it."""
        with self._login:
            if self._refused_login:
                self._closing.wait(1.0)
                return
            try:
                self.connection.log_in_again()
            except InputError as error:
                self._refused_login = True
                log.error("%s Recording goes on without the robot.", error)
            except LiosError as error:
                log.warning("%s", error)
                self._closing.wait(1.0)
