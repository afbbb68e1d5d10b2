"""The runs that a dashboard can open: named logs, or all of a folder; each is read when first shown."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock

from dashboards.geometry.house import HouseShape, house_shape
from dashboards.library.run_table import NotRecorded, evaluation_in, log_rows, trial_rows
from dashboards.model.replay_bounds import stored_bounds
from dashboards.model.timeline import Timeline, timeline_of
from dashboards.panels.folder.runs import RunRow
from dashboards.sensing.robot_sensors import RobotSensors, sensors_of
from replayers.live.ghost_bounds import GhostReport
from replayers.log_tools.notes import RunNote, notes_of
from replayers.runs.growing_log import GrowingLog
from workbench.beliefs.memory.history import History
from workbench.caches import Cache
from workbench.errors import FileMissing, LiosError, NotFound
from workbench.log_schema.events import NANO, SeenItem
from workbench.worlds.house import FloorPlan

SENSORS_EVERY_S, SENSORS_REST = 2.0, 10.0
"""How long to wait before the sensors of a growing log are indexed again: seconds, or multiples of the time it
took."""
MAX_CACHED_RUNS = 24
"""Runs, and places, kept in memory; the least recently used is dropped first."""


class NoLogsInFolder(NotFound):
    """A folder without logs."""

    def __init__(self, folder: Path) -> None:
        super().__init__(f"{folder}: no .mcap logs in this folder. Record one with lios record, or name a log.")


class Library:
    """The logs of one viewer. Only these can be read through it, by their index in the list.

    Raises:
        FileMissing: a path does not exist.
        NoLogsInFolder, NotRecorded: a folder without logs.
        MalformedFile: the folder of an evaluation whose table cannot be read.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self.folder = paths[0] if len(paths) == 1 and paths[0].is_dir() else None
        self.trials = (evaluation_in(self.folder) or []) if self.folder is not None else []
        """The rows of an evaluation, where its folder was opened."""
        named = [t.log for t in self.trials if t.log.is_file()] if self.trials else logs_of(paths)
        if self.folder is not None and not named:
            raise NotRecorded(self.folder)
        self.paths = tuple({path.resolve(): path for path in named}.values())
        self._timelines: Cache[int, Timeline] = Cache(MAX_CACHED_RUNS)
        self._robot_sensors: Cache[int, RobotSensors | None] = Cache(MAX_CACHED_RUNS)
        self._sensors_fresh_until: dict[int, float] = {}
        self._truths: Cache[int, Mapping[str, tuple[SeenItem, ...]] | None] = Cache(MAX_CACHED_RUNS)
        self._notes: Cache[int, tuple[RunNote, ...]] = Cache(MAX_CACHED_RUNS)
        self._shapes: Cache[FloorPlan, HouseShape] = Cache(MAX_CACHED_RUNS)
        self._lock = Lock()
        self._rows: list[RunRow] | None = None
        self.unreadable: list[str] = []
        self.history: History | None = None
        """What the logs remember of their place, where that was asked for."""
        self.ghosts: GhostReport | None = None
        """What the replays beside a run that is being recorded say; None where there are none."""
        self.followed = False
        """Whether a run that has not ended is still being recorded."""
        self._growing: dict[int, GrowingLog] = {}
        self._awaited: frozenset[int] = frozenset()

    def timeline(self, index: int) -> Timeline:
        """The timeline of the index-th log.

        Raises:
            IndexError: there is no such log.
            LiosError: the log cannot be read.
        """
        with self._lock:
            return self._timelines.get(index, lambda: self._timeline(index))

    def expect_logs(self, paths: Sequence[Path]) -> tuple[int, ...]:
        """Adds logs that do not exist yet; their indices."""
        first = len(self.paths)
        self.paths = (*self.paths, *paths)
        added = tuple(range(first, len(self.paths)))
        self._awaited = self._awaited | frozenset(added)
        return added

    def is_expected(self, index: int) -> bool:
        """Whether a log that was added before it existed is still not there."""
        if index in self._awaited and self.paths[index].exists():
            self._awaited, self._rows = self._awaited - {index}, None
        return index in self._awaited

    def robot_sensors(self, index: int) -> RobotSensors | None:
        """The sensors of the index-th log; None for a log without sensors, or one that cannot be read."""
        with self._lock:
            return self._robot_sensors.get(index, lambda: self._sensors(index))

    def truth(self, index: int) -> Mapping[str, tuple[SeenItem, ...]] | None:
        """The true contents of every container in the index-th log; None where it was not recorded.

        Raises:
            IndexError: there is no such log.
            LiosError: the log cannot be read.
        """
        with self._lock:
            return self._truths.get(index, lambda: self._truth(self.paths[index]))

    def notes(self, index: int) -> tuple[RunNote, ...]:
        """The notes of people on the index-th log, by time; none where they cannot be read."""
        with self._lock:
            return self._notes.get(index, lambda: _notes(self.paths[index]))

    def add_note(self, index: int, words: str, *, stamp_ns: int, author: str = "") -> None:
        """Writes a note into the index-th log, as `lios log note` does.

        Raises:
            LiosError: what add_note raises: the log is still being recorded, or may not be written.
        """
        from replayers.log_tools.info import describe
        from replayers.log_tools.notes import add_note

        after_ns = stamp_ns - describe(self.paths[index]).origin.stamp_ns  # clocks of simulators may begin at 0
        add_note(self.paths[index], words, at=f"{after_ns / NANO:.9f}", author=author)
        with self._lock:
            self._notes.drop(index)

    def rows(self) -> list[RunRow]:
        """One row for each run, from indexes and tables; no run is read for it."""
        if self._rows is None:
            self._rows = trial_rows(self.trials, self.paths) if self.trials else []
            if not self.trials:
                there = tuple(path for i, path in enumerate(self.paths) if not self.is_expected(i))
                self._rows, self.unreadable = log_rows(there, folder=self.folder)
        return self._rows

    def read_growth(self, index: int) -> Timeline:
        """The timeline of a run that is being recorded, with what was added to its log since the last time."""
        self._growing.setdefault(index, GrowingLog(self.paths[index]))
        return self.reread(index)

    def reread(self, index: int) -> Timeline:
        """The timeline of a run, read again from its log as it now is."""
        with self._lock:
            self._timelines.drop(index)
            self._truths.drop(index)
            self._notes.drop(index)
            if time.monotonic() > self._sensors_fresh_until.get(index, 0.0):
                self._robot_sensors.drop(index)
        return self.timeline(index)

    def shape(self, plan: FloorPlan) -> HouseShape:
        """The geometry of a floor plan, computed once."""
        with self._lock:
            return self._shapes.get(plan, lambda: house_shape(plan))

    def _timeline(self, index: int) -> Timeline:
        from replayers.runs.run import read

        path = self.paths[index]
        added = self._growing[index].read() if index in self._growing else None
        return timeline_of(added or read(path), counterfactual=stored_bounds(path))

    def _sensors(self, index: int) -> RobotSensors | None:
        began = time.monotonic()
        try:
            return sensors_of(self.paths[index])
        except LiosError:
            return None
        finally:
            ended = time.monotonic()
            self._sensors_fresh_until[index] = ended + max(SENSORS_EVERY_S, SENSORS_REST * (ended - began))

    def _truth(self, path: Path) -> Mapping[str, tuple[SeenItem, ...]] | None:
        from replayers.runs.run import read

        truth = read(path, with_truth=True).truth
        return truth.contents if truth is not None else None


def _notes(path: Path) -> tuple[RunNote, ...]:
    try:
        return tuple(notes_of(path))
    except LiosError:
        return ()


def logs_of(paths: Sequence[Path]) -> list[Path]:
    """The named logs, and those in named folders, sorted within each folder."""
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(p for p in path.rglob("*.mcap") if p.is_file())
            if not inside:
                raise NoLogsInFolder(path)
            found += inside
        elif path.exists():
            found.append(path)
        else:
            raise FileMissing(path)
    return found
