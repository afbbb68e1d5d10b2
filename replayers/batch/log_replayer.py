"""Replays of strategies over one log, with those kept from before; the log is prepared when first needed.

What is kept already under the same key (log, strategy, settings, version) is read and not made again. A planner or an
estimator from outside always runs again, since its code may have changed. A log that cannot be replayed is a row that
says so.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import final

import msgspec

from recorders.mcap_io.file import LogInUse
from replayers.batch.store import SUFFIX, StoredReplay, read_replay, replay_key, replay_path, to_stored, write_replay
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import WORLDS, Replay, over_log_alone, replay_on
from replayers.counterfactual.sandbox import is_foreign
from replayers.runs.run import Run, read
from workbench.beliefs.estimators import ESTIMATORS, is_built_in
from workbench.errors import FileMissing, LiosError, MalformedFile
from workbench.execution.events import RunStatus
from workbench.planning.strategies import needs_truth, strategy
from workbench.plugins import ESTIMATOR, NameOrigin, installed_names

WRITER_PATIENCE_S = 60.0
"""How long another process may write a recording that this one is to write too: two calls with one folder."""

NEW_OBJECTS = 500_000
"""Allocations before the garbage collector runs again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayRequest:
    """What to replay and where to keep it.

    Attributes:
        strategies: by name; "all" has been spelt out.
        origin: who gives these names.
        output: the folder that keeps replays; None keeps nothing.
        write_logs: also record each replay as MCAP in the folder.
        worlds: of replay.WORLDS, those in which the run is recorded besides.
    """

    strategies: tuple[str, ...]
    settings: ReplaySettings
    output: Path | None = None
    write_logs: bool = False
    worlds: tuple[str, ...] = ()
    origin: NameOrigin = NameOrigin.LOG

    def is_foreign(self, name: str) -> bool:
        """Whether one of the strategies is a planner from outside."""
        return is_foreign(name, origin=self.origin)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogFailed:
    """A log that could not be replayed, or a strategy that could not be run over it."""

    log: str
    strategy: str
    reason: str


Outcome = StoredReplay | LogFailed


@final
class LogReplayer:
    """One log for all strategies to be replayed over it.

    Attributes:
        failure: why it cannot be read; None if it can.
    """

    def __init__(self, log: Path, request: ReplayRequest) -> None:
        self.failure: LogFailed | None = None
        self._log = str(log)
        self._request = request
        self._run: Run | None = None
        self._prepared: PreparedLog | LiosError | None = None
        try:
            self._run = read(log, with_truth=request.settings.with_truth, with_poses=False)
        except LiosError as error:
            self.failure = LogFailed(log=self._log, strategy="", reason=str(error))

    def known_outcome(self, name: str) -> Outcome | None:
        """What is known of a strategy over this log without running it: stored, or impossible. None if it must be
        run."""
        if needs_truth(name) and not self._request.settings.with_truth:
            reason = "it knows the whole house: give --with-truth"
            return LogFailed(log=self._log, strategy=name, reason=reason)
        path = self._path(name)
        if path is None or self._may_have_changed(name):
            return None
        stored = _stored_replay(path, self._key(name), self._request)
        # It may be kept from a copy, or from before the log was moved.
        return None if stored is None else msgspec.structs.replace(stored, log=self._log)

    def made(self, name: str) -> Outcome:
        """A strategy replayed over this log, and stored where that is wanted."""
        prepared = self.prepared
        if not isinstance(prepared, PreparedLog):
            return LogFailed(log=self._log, strategy=name, reason=str(prepared))
        path, key = self._path(name), self._key(name)
        same = path is not None and not self._may_have_changed(name) and _has_key(path, key)
        return _one(prepared, name, key, path, self._request, same=same)

    @property
    def prepared(self) -> PreparedLog | LiosError:
        """The prepared log, or the reason why it cannot be prepared."""
        if self._prepared is None:
            try:
                self._prepared = prepare_log(self.run, self._request.settings, with_paths=self._request.write_logs)
            except LiosError as error:
                self._prepared = error
        return self._prepared

    @property
    def run(self) -> Run:
        assert self._run is not None, "a log that cannot be read has a failure"
        return self._run

    def load(self, name: str) -> None:
        """Runs a strategy over the log alone to load its code, so that forked processes have it."""
        with suppress(LiosError):  # reported when the strategy is replayed
            if isinstance(self.prepared, PreparedLog) and not self._request.is_foreign(name):
                over_log_alone(self.prepared, strategy(name, origin=self._request.origin))

    def _may_have_changed(self, name: str) -> bool:
        """Whether the strategy or the estimator is third-party code or a file, whose versions no key
        distinguishes."""
        believer = self._request.settings.estimator
        if believer == "log":
            changes = self.run.info.estimator.partition("@")[0] in installed_names(ESTIMATOR, is_built_in)
        else:
            changes = believer != "first" and believer not in ESTIMATORS
        return changes or self._request.is_foreign(name)

    def _key(self, name: str) -> str:
        return replay_key(self.run.sha256, name, self._request.settings)

    def _path(self, name: str) -> Path | None:
        output = self._request.output
        misses = self._request.settings.assumptions.misses
        return replay_path(output, self.run.sha256, self.run.info.run_id, name, misses=misses) if output else None


def replay_log(log: Path, request: ReplayRequest) -> Iterator[Outcome]:
    """Replays every strategy over one log, one by one."""
    with gc_frozen():
        yield from replayed(LogReplayer(log, request), request)


def replayed(
    one: LogReplayer,
    request: ReplayRequest,
    elsewhere: Mapping[str, Future[dict[str, Outcome]]] = MappingProxyType({}),
) -> Iterator[Outcome]:
    """Replays every strategy over a log that was read; a single row where the log cannot be replayed.

    Args:
        elsewhere: strategies that another process replays.
    """
    if one.failure is not None:
        yield one.failure
        return
    for name in request.strategies:
        if name in elsewhere:
            yield elsewhere[name].result()[name]
        else:
            yield one.known_outcome(name) or one.made(name)


@contextmanager
def gc_frozen() -> Generator[None]:
    """Meanwhile the garbage collector ignores what exists already and runs less often: what a replay makes is either
    kept or freed by reference counts."""
    before = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(max(before[0], NEW_OBJECTS) if before[0] else 0, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()


def _one(
    prepared: PreparedLog, name: str, key: str, path: Path | None, request: ReplayRequest, *, same: bool
) -> Outcome:
    try:
        made = replay_on(prepared, name, origin=request.origin, worlds=request.worlds)
    except LiosError as error:
        return LogFailed(log=prepared.evidence.path, strategy=name, reason=str(error))
    record = to_stored(prepared, made, key=key)
    if path is not None:
        if request.write_logs and made.status is RunStatus.NOT_REPRODUCED:
            for world in ("", *WORLDS):
                log_path(path, world).unlink(missing_ok=True)
        elif request.write_logs:
            _write_logs(path, prepared, made, same=same)
        write_replay(path, record)
    return record


def _write_logs(path: Path, prepared: PreparedLog, made: Replay, *, same: bool) -> None:
    """Writes the recordings of a stored replay; recordings in worlds are removed first if they are of an earlier
    replay."""
    from replayers.batch.replay_log import write_replay_log

    if not same:
        for world in WORLDS:
            log_path(path, world).unlink(missing_ok=True)
    for world in ("", *made.worlds):
        _when_free(partial(write_replay_log, log_path(path, world), prepared, made, world=world, force=True))


def _when_free(write: Callable[[], None]) -> None:
    """Writes a recording; while another process writes the same one into the folder, waits until it has.

    Raises:
        LogInUse: it takes longer than WRITER_PATIENCE_S.
    """
    until = time.monotonic() + WRITER_PATIENCE_S
    while True:
        try:
            write()
        except LogInUse:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)
        else:
            return


def _has_key(path: Path, key: str) -> bool:
    """Whether the stored replay at a path has that key."""
    with suppress(FileMissing, MalformedFile):
        return read_replay(path).key == key
    return False


def _stored_replay(path: Path, key: str, request: ReplayRequest) -> StoredReplay | None:
    """A stored replay of the same key, complete with its log if that is wanted."""
    if request.write_logs and not log_path(path).exists():
        return None
    try:
        record = read_replay(path)
    except (FileMissing, MalformedFile):
        return None
    if record.key != key:
        return None
    expected = [world for world in request.worlds if _has_world_run(world, record)]
    return record if all(log_path(path, world).exists() for world in expected) else None


def _has_world_run(world: str, record: StoredReplay) -> bool:
    """Whether a replay has a run in such a world to record: a run was followed to its end, or worlds were sampled."""
    if record.bounds is None:
        return False
    if world == "drawn":
        return record.estimate is not None
    return isfinite(record.bounds.least_found if world == "best" else record.bounds.largest_found)


def log_path(path: Path, world: str = "") -> Path:
    """Path of the recording of a stored replay: beside it; in a world, with the world's name before the suffix."""
    stem = path.name.removesuffix(SUFFIX)
    return path.with_name(f"{stem}.{world}.replay.mcap" if world else f"{stem}.replay.mcap")
