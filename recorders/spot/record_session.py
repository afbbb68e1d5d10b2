"""Recording of an operator-driven session: sensor data, derived actions, and keys for notes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from recorders.run_identity import Driver
from recorders.run_recorder import RunRecorder
from recorders.sinks.files import LogFiles, Sink, SplitLimits
from recorders.sinks.mirrored import ViewerFeed
from recorders.sinks.ring_buffer import RingBuffer
from recorders.sinks.threaded import ThreadedSink
from recorders.spot.client.connection import Connection
from recorders.spot.client.identity import robot_metadata, robot_run_info
from recorders.spot.client.services import require_services, services_of_cameras
from recorders.spot.run.operator import KeyboardOperator, StopSwitch, stop_on_signals
from recorders.spot.run.site_tasks import place_of, session_task
from recorders.spot.session.inferred_actions import ActionDeriver
from recorders.spot.session.sensor_pollers import check_cameras, wanted_cameras
from recorders.spot.session.session import Rates, Session
from recorders.spot.session.topics import SessionStatus
from workbench.errors import OutputExists
from workbench.execution.events import RunEnded, RunStatus
from workbench.log_schema.events import RunInfo
from workbench.log_schema.perception_json import perception_to_settings
from workbench.log_schema.run_info import ROBOT_METADATA
from workbench.planning.tasks import Task
from workbench.search.costs import ROBOT_COSTS
from workbench.terminal import counted, say
from workbench.worlds.sites.site import Site

OPERATOR = "operator"
"""The strategy that the log of a session names."""
REPLAY_ESTIMATOR = "best"
"""The estimator for replays of a session, which itself used none."""
POLL_S = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionPlan:
    """The settings of a recorded session.

    Attributes:
        task: the task of the session; without it there is no goal.
        for_s: duration in seconds; None until a key is pressed.
        split: when the log continues in another file.
        operator_name: who drives, for the log. log_serial: whether the log names the robot's serial number.
        furniture_open: the operator's word that all closed furniture was opened before.
        audience: viewers that are shown every message once it is written.
        show_status: called with the session's status, once a second.
        keep_last_s: keep only the last seconds, in memory, and write them on demand (key w) and at the end.
    """

    site: Site
    task: Task | None = None
    rates: Rates = field(default_factory=Rates)
    for_s: float | None = None
    split: SplitLimits | None = None
    keep_last_s: float | None = None
    furniture_open: bool = False
    operator_name: str = ""
    log_serial: bool = True
    audience: ViewerFeed | None = None
    show_status: Callable[[SessionStatus], None] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionReport:
    """The result of a recorded session.

    Attributes:
        taken, skipped: per stream: answers recorded, and polls skipped while it was busy.
        dropped: messages dropped by the writer, by topic.
        failed: failed polls per stream. troubles: streams that failed until the end, and why.
        files: the files written.
        gaps_s: durations of outages in seconds.
    """

    ended: RunEnded
    seconds: float
    taken: dict[str, int]
    skipped: dict[str, int]
    dropped: dict[str, int]
    gaps_s: tuple[float, ...]
    failed: dict[str, int] = field(default_factory=dict)
    troubles: dict[str, str] = field(default_factory=dict)
    files: tuple[Path, ...] = ()

    def as_json(self) -> dict[str, Any]:
        return {
            "seconds": self.seconds,
            "status": self.ended.status,
            "searches": self.ended.searches,
            "taken": self.taken,
            "skipped": self.skipped,
            "dropped": self.dropped,
            "gaps_s": list(self.gaps_s),
            "failed": self.failed,
            "troubles": self.troubles,
            "files": [str(path) for path in self.files],
        }

    def in_words(self) -> str:
        lost = sum(self.dropped.values())
        troubles = "".join(f"; NO {name} ({why})" for name, why in self.troubles.items())
        gaps = f", {len(self.gaps_s)} gaps of {sum(self.gaps_s):.1f} s" if self.gaps_s else ""
        output = self.files[-1] if self.files else ""
        to = f"{len(self.files)} files, {self.files[0]} to {output}" if len(self.files) > 1 else output
        return (
            f"{self.seconds:.0f} s recorded to {to}: {sum(self.taken.values())} answers, {lost} messages lost"
            f"{gaps}, {counted(self.ended.searches, 'container')} looked into{troubles}. Next: lios info {output}"
        )


class SessionEnd:
    """How the session ends, as set by a key."""

    def __init__(self) -> None:
        self.status: RunStatus | None = None
        self.reason = ""
        self.over = False

    def by_key(self, key: str) -> None:
        if key in "dDfFqQ":
            self.over = True
        if key in "dD":
            self.status, self.reason = RunStatus.DONE, "the operator says that it is done"
        if key in "fF":
            self.status, self.reason = RunStatus.ABORTED, "the operator says that it failed"


def record_session(
    connection: Connection, plan: SessionPlan, output: Path, *, force: bool = False, ending: SessionEnd | None = None
) -> SessionReport:
    """Record until a key, a signal or the time limit; the log is always closed properly."""
    ending, stop = ending or SessionEnd(), StopSwitch()
    task = plan.task or session_task()
    cameras = wanted_cameras(plan.site, plan.rates)
    require_services(connection, services_of_cameras(cameras))
    check_cameras(connection, cameras)
    kept = None if plan.keep_last_s is None else RecentMoments(output, plan.keep_last_s, force=force)
    files = LogFiles(output, force=force, split=plan.split) if kept is None else kept.ring
    robot = robot_metadata(connection, operator=plan.operator_name, serial=plan.log_serial)
    with RunRecorder(
        output,
        info=session_info(connection, plan.site, task),
        place=place_of(plan.site),
        task=task,
        costs=ROBOT_COSTS,
        background=True,
        sink=files,
        audience=plan.audience,
        receipt_ns=connection.clock.now_ns,
        settings=perception_to_settings(plan.site.perception),
    ) as recorder:
        recorder.sink.describe(ROBOT_METADATA, robot)
        session = Session(connection, plan.site, recorder.sink, rates=plan.rates)
        derived = ActionDeriver(
            site=plan.site,
            task=task,
            costs=ROBOT_COSTS,
            tell=recorder.record,
            closed_needs_word=True,
            furniture_open=plan.furniture_open,
            perception=plan.site.perception,
        )
        session.watch, session.show_status = derived, plan.show_status
        keys: KeyboardOperator = KeyboardOperator(
            stop,
            lambda key: (
                _tell_opened(session, derived) if key in "oO" else _key_pressed(key, keys, session, ending, kept)
            ),
            stop_keys=("\x03",),
        )
        began = time.monotonic()
        until = began + plan.for_s if plan.for_s is not None else float("inf")
        with stop_on_signals(stop), session, keys:
            while (
                not ending.over and not stop.is_pressed and recorder.stop_reason is None and time.monotonic() < until
            ):
                time.sleep(POLL_S)
        seconds = time.monotonic() - began
        ended = derived.end(status=ending.status, reason=ending.reason)
        _tell_inconclusive(session, derived)
        if kept is not None:
            kept.save_the_end(recorder.sink)
        dropped = recorder.sink.dropped if isinstance(recorder.sink, ThreadedSink) else {}
    written = tuple(files.parts if isinstance(files, LogFiles) else () if kept is None else kept.files)
    return _report(session, ended, seconds, dropped, written)


def _report(
    session: Session, ended: RunEnded, seconds: float, dropped: dict[str, int], files: tuple[Path, ...]
) -> SessionReport:
    return SessionReport(
        ended=ended,
        seconds=seconds,
        taken=dict(sorted(session.taken.items())),
        skipped=dict(sorted(session.skipped.items())),
        dropped=dropped,
        gaps_s=tuple(session.gaps),
        failed=dict(sorted(session.failed.items())),
        troubles=dict(sorted(session.troubles.items())),
        files=files,
    )


class RecentMoments:
    """The last seconds in memory, saved on demand and at the end; the last save goes to `output`.

    Raises:
        OutputExists: the output exists and `force` is false.
    """

    def __init__(self, output: Path, seconds: float, *, force: bool) -> None:
        if output.exists() and not force:
            raise OutputExists(output)
        self.ring = RingBuffer(output, keep_s=seconds)
        self.files: list[Path] = []
        self._output, self._force = output, force

    def save(self) -> Path:
        """Save the last seconds to NAME_0000.mcap, NAME_0001.mcap, ..."""
        path = self._output.with_name(f"{self._output.stem}_{len(self.files):04d}{self._output.suffix}")
        self.files.append(self.ring.save(path, force=self._force))
        return path

    def save_the_end(self, sink: Sink) -> None:
        if isinstance(sink, ThreadedSink):
            sink.wait()
        self.files.append(self.ring.save(self._output, force=self._force))


def _key_pressed(
    key: str, keys: KeyboardOperator, session: Session, ending: SessionEnd, kept: RecentMoments | None
) -> None:
    """Handle a key: n opens a note, m sets a mark, w saves the last seconds; the others end the session."""
    pressed_ns = session.now_ns()

    def note(text: str) -> None:
        session.note(text or "mark", at_ns=pressed_ns)
        say(f"Noted: {text or 'mark'}")

    if key in "nN":
        keys.take_line("Note (Enter ends it, Esc drops it): ", note)
    elif key in "mM":
        note("")
    elif key in "wW" and kept is not None:
        session.note("moment saved", at_ns=pressed_ns)
        say(f"Written: {kept.save()}")
    else:
        ending.by_key(key)


def _tell_opened(session: Session, derived: ActionDeriver) -> None:
    """Key o: the operator says that the container at hand stands open."""
    at = derived.opened(session.now_ns())
    text = "no container is at hand" if at is None else f"{at} was opened"
    if at is not None:
        session.note(text)
    say(f"Noted: {text}" if at is not None else f"Nothing noted: {text}")


def _tell_inconclusive(session: Session, derived: ActionDeriver) -> None:
    for look in derived.inconclusive:
        session.note(
            f"Look into {look.container} is inconclusive and counts as not looked: {look.reason}", at_ns=look.end_ns
        )


def session_info(connection: Connection, site: Site, task: Task) -> RunInfo:
    """The identity of an operator-driven session."""
    driver = Driver(strategy=OPERATOR, estimator=REPLAY_ESTIMATOR)
    return robot_run_info(connection, site, task, driver, id_salt="session")
