"""How are many logs replayed by many strategies? A log at a time in a process each, kept as files, resumable.

What is kept already under the same key (log, strategy, settings, version) is read and not made again; a planner from
outside always runs again, since its code may have changed. A log that cannot be replayed is a row that says so; it
does not stop the others.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from replayers.ground import Ground, Settings, ground_of
from replayers.replay import replay_on
from replayers.run import Run, read
from replayers.sandbox import is_foreign
from replayers.stored_replays import SUFFIX, StoredReplay, key_of, path_of, read_replay, stored, write_replay
from workbench.errors import BadValue, FileMissing, LiosError, MalformedFile
from workbench.planning.strategies import needs_truth, resolved_name, strategy_names
from workbench.process_pool import process_pool

NEW_OBJECTS = 500_000
"""Before the collector comes again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What to replay and where to keep it.

    Attributes:
        strategies: by name; "all" has been spelt out.
        output: the folder that keeps replays; None keeps nothing.
        write_logs: also record each replay as MCAP in the folder.
        worlds: of replay.WORLDS, those in which the run is recorded besides.
    """

    strategies: tuple[str, ...]
    settings: Settings
    output: Path | None = None
    write_logs: bool = False
    worlds: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LogFailed:
    """A log that could not be replayed, or a strategy that could not be run over it."""

    log: str
    strategy: str
    reason: str


Outcome = StoredReplay | LogFailed


def logs_among(paths: Iterable[Path]) -> tuple[Path, ...]:
    """The logs that paths name: files as given, folders with every .mcap below them that is no replay; sorted.

    Raises:
        FileMissing: a path that is not there.
        MalformedFile: a folder without a log.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if path.is_dir():
            inside = [p for p in sorted(path.rglob("*.mcap")) if not p.name.endswith(".replay.mcap")]
            if not inside:
                raise MalformedFile(path, "no .mcap file in this folder", "Give a log, or a folder of logs")
            found.update(dict.fromkeys(inside))
        elif path.exists():
            found[path] = None
        else:
            raise FileMissing(path)
    return tuple(found)


def strategies_named(text: str, *, with_truth: bool) -> tuple[str, ...]:
    """The strategies that a comma-separated list means; "all" is every one that can be replayed here.

    Raises:
        BadValue: the list names none.
    """
    names: dict[str, None] = {}
    for part in (p.strip() for p in text.split(",")):
        if part == "all":
            names.update(dict.fromkeys(strategy_names(with_truth=with_truth)))
        elif part:
            names[resolved_name(part)] = None
    if not names:
        raise BadValue("--strategies", text, "all, or names with commas between them")
    return tuple(names)


def replay_all(logs: Sequence[Path], wanted: Wanted, *, workers: int | None = None) -> Iterator[Outcome]:
    """Replays every strategy over every log, in the order of the logs and then the strategies."""
    count = min(workers or os.cpu_count() or 1, len(logs))
    if count <= 1:
        for log in logs:
            yield from replay_log(log, wanted)
        return
    with process_pool(count) as pool:
        for outcomes in pool.map(_all_of, [(log, wanted) for log in logs]):
            yield from outcomes


def replay_log(log: Path, wanted: Wanted) -> Iterator[Outcome]:
    """Replays every strategy over one log, one by one."""
    with _what_is_loaded_stays():
        yield from _replayed(log, wanted)


def _replayed(log: Path, wanted: Wanted) -> Iterator[Outcome]:
    try:
        run = read(log, with_truth=wanted.settings.with_truth)
        sha256, run_id = run.sha256, run.info.run_id
    except LiosError as error:
        yield LogFailed(log=str(log), strategy="", reason=str(error))
        return
    ground: Ground | LiosError | None = None
    for name in wanted.strategies:
        if needs_truth(name) and not wanted.settings.with_truth:
            yield LogFailed(log=str(log), strategy=name, reason="it knows the whole house: give --with-truth")
            continue
        key = key_of(sha256, name, wanted.settings)
        path = path_of(wanted.output, sha256, run_id, name) if wanted.output else None
        kept = _kept(path, key, wanted) if path and not is_foreign(name) else None
        if kept is not None:
            yield kept
            continue
        if ground is None:
            ground = _ground(run, wanted.settings)
        yield (
            _one(ground, name, key, path, wanted)
            if isinstance(ground, Ground)
            else LogFailed(log=str(log), strategy=name, reason=str(ground))
        )


@contextmanager
def _what_is_loaded_stays() -> Generator[None]:
    """Meanwhile the collector need not walk again and again through what was there before, nor come so often:
    what a replay makes is kept, or goes without it."""
    before = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(max(before[0], NEW_OBJECTS) if before[0] else 0, *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
        gc.unfreeze()


def _ground(run: Run, settings: Settings) -> Ground | LiosError:
    try:
        return ground_of(run, settings)
    except LiosError as error:
        return error


def _one(ground: Ground, name: str, key: str, path: Path | None, wanted: Wanted) -> Outcome:
    try:
        made = replay_on(ground, name, worlds=wanted.worlds)
    except LiosError as error:
        return LogFailed(log=ground.evidence.path, strategy=name, reason=str(error))
    record = stored(ground, made, key=key)
    if path is not None:
        if wanted.write_logs:
            from replayers.origin import write_replay_log

            write_replay_log(log_path(path), ground, made, force=True)
            for world in made.worlds:
                write_replay_log(log_path(path, world), ground, made, world=world, force=True)
        write_replay(path, record)
    return record


def _kept(path: Path, key: str, wanted: Wanted) -> StoredReplay | None:
    """A kept replay of the same key, complete with its log if that is wanted."""
    if wanted.write_logs and not log_path(path).exists():
        return None
    try:
        record = read_replay(path)
    except (FileMissing, MalformedFile):
        return None
    if record.bounds is not None and not all(log_path(path, world).exists() for world in wanted.worlds):
        return None
    return record if record.key == key else None


def log_path(path: Path, world: str = "") -> Path:
    """Where the recording of a kept replay stands: beside it; in a world, with the world before its suffix."""
    stem = path.name.removesuffix(SUFFIX)
    return path.with_name(f"{stem}.{world}.replay.mcap" if world else f"{stem}.replay.mcap")


def _all_of(task: tuple[Path, Wanted]) -> list[Outcome]:
    return list(replay_log(*task))
