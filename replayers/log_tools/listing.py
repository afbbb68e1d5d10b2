"""The runs of a folder, one row for each log, read from indexes and cached between calls.

Of a run's log the checksums and the numbers of events are read too, to show where something is missing. Of logs of
replays, observations are read too, to count the containers whose contents are imputed. The cache is one file for each
folder under $LIOS_CACHE (or ~/.cache/lios-workbench); a row is reused while the log's size and modification time are
unchanged.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from replayers.log_tools.log_paths import shown
from workbench.errors import LiosError
from workbench.files import cache_folder, write_atomically
from workbench.log_schema.run_info import PART_METADATA
from workbench.message_enum import MessageEnum, Result
from workbench.remote.path import RemotePath

if TYPE_CHECKING:
    from replayers.log_tools.info import Description

LIST_VERSION = 6
STAT_WORKERS = 8
REMOTE_READERS = 64
REPLAY, OBSERVATIONS, IMPUTED = "replay", "/search/observation", "imputed"
"""The source of a replay's log, the topic of what was seen, and the support of what nobody saw."""
UNDECIDED = "undetermined"
"""The outcome of a replay whose cost the log cannot settle. Its partial cost is not reported as cost."""


Check = Callable[["Description"], tuple[str, ...]]
"""What is missing from a log, a line for each kind of loss."""


class Completeness(MessageEnum):
    """Whether a log is a whole run, as far as its checksums and its metadata tell, and if not, why."""

    WHOLE = ""
    NOT_ONE_RUN = "holds {runs}"
    NOT_WHOLE = "not whole: {lost}"
    RECOVERED = "recovered: {damages} places were lost"
    PART = "part {part} of a split run"
    CUT_OFF = "cut off: its end is missing"
    CUT_OFF_WITHOUT_RUN = "cut off, holds no run"


class LogRow(msgspec.Struct, frozen=True, kw_only=True):
    """One log.

    problem says why it could not be read, or is not whole; lost, what had to be dropped, or is missing from its run;
    cut_off, that it ends early. status is
    missing where it has no outcome, cost there too, and where a replay is undecided. imputed counts the containers
    whose contents nobody saw: the log is of a replay in an imagined world.
    """

    file: str
    place: str = ""
    scenario: str = ""
    strategy: str = ""
    estimator: str = ""
    seed: int | None = None
    status: str = ""
    cost: float | None = None
    searches: int | None = None
    duration_s: float | None = None
    messages: int = 0
    size_bytes: int = 0
    closed: bool = False
    source: str = ""
    run_id: str = ""
    started_ns: int = 0
    imputed: int = 0
    lost: tuple[str, ...] = ()
    cut_off: bool = False
    problem: str = ""


class _Known(msgspec.Struct, frozen=True):
    size: int
    changed_ns: int
    row: LogRow
    checked: bool


class _Memory(msgspec.Struct):
    version: int
    rows: dict[str, _Known]


def rows_of(
    paths: Sequence[Path],
    *,
    memory: Path | None = None,
    progress: Callable[[Iterator[Path]], Iterator[Path]] = iter,
    check: Check | None = None,
) -> list[LogRow]:
    """One row for each log, in the order given.

    Args:
        memory: the cache file; nothing is cached if not given.
        progress: wraps the logs that must be read, for a progress bar.
        check: finds what is missing from a log of runs; not looked for if not given, and only indexes are read.
    """
    known = _recall(memory)
    with ThreadPoolExecutor(STAT_WORKERS) as pool:
        states = list(pool.map(_state, paths))
    fresh: dict[str, _Known] = {}
    new = [
        p
        for p, state in zip(paths, states, strict=True)
        if not _is_current(known.get(shown(p)), state, check is not None)
    ]
    for path, row in _read(new, partial(row_of, check=check), progress):
        fresh[shown(path)] = _Known(*_state(path), row, check is not None)
    if fresh:
        known.update(fresh)
        _remember(memory, {shown(p): known[shown(p)] for p in paths})
    return [known[shown(path)].row for path in paths]


def _read(
    paths: Sequence[Path], read: Callable[[Path], LogRow], progress: Callable[[Iterator[Path]], Iterator[Path]]
) -> Iterator[tuple[Path, LogRow]]:
    """The rows of logs: many at a time where they lie at addresses, since each answer is waited for."""
    with ThreadPoolExecutor(REMOTE_READERS) as pool:
        remote: list[Path] = [path for path in paths if isinstance(path, RemotePath)]
        coming = {path: pool.submit(read, path) for path in remote}
        for path in progress(iter(paths)):
            yield path, coming[path].result() if path in coming else read(path)


def row_of(path: Path, *, check: Check | None = None) -> LogRow:
    """The row of one log; a log that cannot be read gets one too."""
    from replayers.log_tools.info import describe

    try:
        found = describe(path)
        lost = check(found) if check is not None else ()
        imputed = _imputed(path) if found.info is not None and found.info.source == REPLAY else frozenset[str]()
    except LiosError as error:
        return LogRow(file=shown(path), problem=shown(str(error)))
    info, outcome = found.info, found.outcome
    return LogRow(
        file=shown(path),
        place=info.place if info else "",
        scenario=info.scenario if info else "",
        strategy=info.strategy if info else "",
        estimator=info.estimator if info else "",
        seed=info.seed if info else None,
        status=outcome.get("status", ""),
        cost=None if outcome.get("status") == UNDECIDED else _number(outcome.get("cost")),
        searches=_whole(outcome.get("searches")),
        duration_s=round(found.duration_s, 3),
        messages=found.index.messages,
        size_bytes=found.size_bytes,
        closed=found.closed,
        source=info.source if info else "",
        run_id=info.run_id if info else "",
        started_ns=info.started.ns if info else 0,
        imputed=len(imputed),
        lost=lost,
        cut_off=_is_cut_off(found),
        problem=_completeness(found, lost).message,
    )


def _completeness(found: Description, lost: tuple[str, ...]) -> Result[Completeness]:
    from replayers.log_tools.recovered import RECOVERED_METADATA, Lost

    if found.info is None and not lost:
        if not found.runs and _is_cut_off(found):
            return Completeness.CUT_OFF_WITHOUT_RUN.result()
        return Completeness.NOT_ONE_RUN.result(runs=f"{found.runs} runs" if found.runs else "no run")
    recovered, part = found.metadata.get(RECOVERED_METADATA, {}), found.metadata.get(PART_METADATA, {})
    if recovered.get("lossy") == "true" and recovered.get("lost") != Lost.END:
        return Completeness.RECOVERED.result(damages=recovered.get("damages", "?"))
    if part and (part.get("part") != "0" or not found.outcome):
        return Completeness.PART.result(part=shown(part.get("part", "?")))
    if lost:
        return Completeness.NOT_WHOLE.result(lost="; ".join(lost))
    return (Completeness.CUT_OFF if _is_cut_off(found) else Completeness.WHOLE).result()


def _is_cut_off(found: Description) -> bool:
    """Whether a log, or the one that it was recovered from, ends early."""
    from replayers.log_tools.recovered import RECOVERED_METADATA, Lost, Recovered

    copied = Recovered.from_facts(found.metadata.get(RECOVERED_METADATA, {}))
    return copied.lost is Lost.END or not (found.closed or found.loss.ended)


def _imputed(path: Path) -> frozenset[str]:
    """The containers of a log whose contents are imputed."""
    from replayers.mcap_io.reader import messages
    from workbench.log_schema.codec import decode
    from workbench.log_schema.events import Observation

    seen = [decode(OBSERVATIONS, message.data) for message in messages(path, topics=OBSERVATIONS.__eq__)]
    return frozenset(o.container for o in seen if isinstance(o, Observation) and o.support == IMPUTED)


def cache_path(folder: Path) -> Path | None:
    """The cache file of a folder's rows; None where nothing should be cached."""
    root = cache_folder()
    if root is None:
        return None
    return root / "list" / f"{hashlib.sha256(os.fsencode(folder.resolve())).hexdigest()[:24]}.json"


def _state(path: Path) -> tuple[int, int]:
    """Size and time of change; (-1, -1) where they are not known, or not without asking a server."""
    if isinstance(path, RemotePath):
        return (-1, -1)
    try:
        state = path.stat()
    except OSError:
        return (-1, -1)
    return (state.st_size, state.st_mtime_ns)


def _is_current(known: _Known | None, state: tuple[int, int], checked: bool) -> bool:
    return known is not None and known.checked >= checked and (known.size, known.changed_ns) == state


def _recall(memory: Path | None) -> dict[str, _Known]:
    if memory is None:
        return {}
    try:
        found = msgspec.json.decode(memory.read_bytes(), type=_Memory)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return {}
    return found.rows if found.version == LIST_VERSION else {}


def _remember(memory: Path | None, rows: dict[str, _Known]) -> None:
    if memory is None:
        return
    try:
        memory.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(memory, msgspec.json.encode(_Memory(LIST_VERSION, rows)))
    except (OSError, UnicodeEncodeError):
        return  # a listing that cannot be cached is still a listing


def _number(text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


def _whole(text: str | None) -> int | None:
    return int(text) if text is not None and text.lstrip("-").isdigit() and len(text) < 19 else None
