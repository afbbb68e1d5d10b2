"""Replays many strategies over many logs, in several processes, with the outcomes in the order of the logs.

Each process takes one log at a time. Where there are fewer logs than processes, the strategies over a log are spread
over the processes: the results are the same, in the same order. A log that cannot be replayed does not stop the
others.
"""

from __future__ import annotations

import filecmp
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, groupby
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from replayers.batch.log_replayer import (
    LogFailed,
    LogReplayer,
    Outcome,
    ReplayRequest,
    gc_frozen,
    log_path,
    replay_log,
    replayed,
)
from replayers.counterfactual.prepared_log import PreparedLog
from replayers.log_tools.log_paths import matching_logs
from workbench.errors import BadValue, FileMissing, MalformedFile
from workbench.planning.strategies import resolved_name, strategy_names
from workbench.remote.path import RemotePath

if TYPE_CHECKING:
    from replayers.batch.work_split import WorkPackage

__all__ = [
    "LogFailed",
    "Outcome",
    "ReplayRequest",
    "log_path",
    "logs_among",
    "replay_all",
    "replay_log",
    "strategies_named",
]

MIN_OPEN_FOR_WORKERS = 6
"""With fewer open containers, one process replays a log before others would have started."""


REPLAY_SUFFIX = ".replay.mcap"
"""Ends the names of replays that are kept as logs."""

Handed = Iterator[Outcome | None]
"""None once all work has been handed out; then the outcomes."""


def logs_among(paths: Iterable[Path]) -> tuple[Path, ...]:
    """The logs that paths name: files as given, and every .mcap of a folder or pattern that is no replay; sorted.

    Raises:
        FileMissing: a path that is not there, or a pattern that none matches.
        MalformedFile: a folder without a log.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if path.is_dir():
            inside = [p for p in sorted(path.rglob("*.mcap")) if not p.name.endswith(REPLAY_SUFFIX)]
            if not inside:
                raise MalformedFile(path, "no .mcap file in this folder", "Give a log, or a folder of logs")
            found.update(dict.fromkeys(inside))
        elif path.exists():
            found[path] = None
        elif matching := [p for p in matching_logs(path) if not p.name.endswith(REPLAY_SUFFIX)]:
            found.update(dict.fromkeys(matching))
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


def replay_all(
    logs: Sequence[Path], request: ReplayRequest, *, workers: int | None = None, scheduler: str = ""
) -> Iterator[Outcome]:
    """Replays every strategy over every log, in the order of the logs and then the strategies.

    Of logs that are copies of one another the first is replayed where replays are kept, since they are kept together.

    Args:
        workers: processes; None for one for each core.
        scheduler: a Dask scheduler's address, whose workers see the same folders under the same names, or "local"
            for a Dask cluster of `workers` on this machine.

    Processes start at once, before the first outcome is asked for: they can be copies of this one only while no other
    thread runs here, such as a progress bar's.
    """
    first_of = _copies(logs) if request.output is not None else {}
    if not first_of:
        return _replay_each(logs, request, workers=workers, scheduler=scheduler)
    once = [log for log in logs if log not in first_of]
    return _with_copies(logs, first_of, _replay_each(once, request, workers=workers, scheduler=scheduler))


def _copies(logs: Sequence[Path]) -> dict[Path, Path]:
    """Logs with the same bytes as an earlier one, and that one. Logs at addresses are not compared."""
    of_size: dict[int, list[Path]] = {}
    for log in logs:
        if not isinstance(log, RemotePath) and log.is_file():
            of_size.setdefault(log.stat().st_size, []).append(log)
    found: dict[Path, Path] = {}
    for alike in of_size.values():
        firsts: list[Path] = []
        for log in alike:
            first = next((other for other in firsts if filecmp.cmp(other, log, shallow=False)), None)
            if first is None:
                firsts.append(log)
            else:
                found[log] = first
    return found


def _with_copies(logs: Sequence[Path], first_of: Mapping[Path, Path], made: Iterator[Outcome]) -> Iterator[Outcome]:
    """The outcomes of all logs in their order, those of a copy under its own name."""
    of_log, copied = groupby(made, key=lambda outcome: outcome.log), set(first_of.values())
    kept: dict[Path, list[Outcome]] = {}
    for log in logs:
        if log in first_of:
            yield from (_renamed(outcome, str(log)) for outcome in kept[first_of[log]])
            continue
        _, outcomes = next(of_log)
        if log in copied:
            outcomes = kept[log] = list(outcomes)
        yield from outcomes


def _renamed(outcome: Outcome, log: str) -> Outcome:
    if isinstance(outcome, LogFailed):
        return replace(outcome, log=log, reason=outcome.reason.replace(outcome.log, log))
    return msgspec.structs.replace(outcome, log=log)


def _replay_each(
    logs: Sequence[Path], request: ReplayRequest, *, workers: int | None, scheduler: str
) -> Iterator[Outcome]:
    count = workers or os.cpu_count() or 1
    if scheduler:
        from workbench.evaluation.cluster import in_order_on_cluster

        work = partial(_all_of, request=request)
        return chain.from_iterable(in_order_on_cluster(work, logs, scheduler=scheduler, workers=count))
    if len(logs) < count and len(request.strategies) > 1 and _can_inherit():
        return _at_work(_in_shares(logs, request, count))
    if min(count, len(logs)) <= 1:
        return chain.from_iterable(replay_log(log, request) for log in logs)
    return _at_work(_log_by_log(logs, request, min(count, len(logs))))


def _can_inherit() -> bool:
    from workbench.process_pool import can_inherit

    return can_inherit()


def _at_work(handed: Handed) -> Iterator[Outcome]:
    next(handed)
    return (outcome for outcome in handed if outcome is not None)


def _log_by_log(logs: Sequence[Path], request: ReplayRequest, count: int) -> Handed:
    from workbench.process_pool import process_pool

    with process_pool(count, inherit=True) as pool:
        made = [pool.submit(_all_of, log, request) for log in logs]
        yield None
        for outcomes in made:
            yield from outcomes.result()


def _in_shares(logs: Sequence[Path], request: ReplayRequest, count: int) -> Handed:
    """Processes share the strategies over a log; they inherit what was read and prepared here."""
    from replayers.batch.work_split import work_packages
    from workbench.process_pool import process_pool

    with gc_frozen():
        opened = {log: LogReplayer(log, request) for log in logs}
        shares = work_packages({log: _much_to_make(one, request) for log, one in opened.items()})
        if len(shares) <= 1:
            yield None
            for log in logs:
                yield from replayed(opened[log], request)
            return
        last = shares[-1]
        opened[last.log].load(last.strategies[0])
        with process_pool(min(count, len(shares)), inherit=True, initializer=partial(_inherit, opened)) as pool:
            made = {share: pool.submit(_share_of, share) for share in shares}
            ahead = {(share.log, name): made[share] for share in shares for name in share.strategies}
            yield None
            for log in logs:
                elsewhere = {name: ahead[log, name] for name in request.strategies if (log, name) in ahead}
                yield from replayed(opened[log], request, elsewhere)


def _much_to_make(one: LogReplayer, request: ReplayRequest) -> tuple[str, ...]:
    """The strategies over a log that are worth starting another process for."""
    if one.failure is not None:
        return ()
    names = tuple(name for name in request.strategies if one.known_outcome(name) is None)
    if (
        not names
        or not isinstance(one.prepared, PreparedLog)
        or len(one.prepared.evidence.open) < MIN_OPEN_FOR_WORKERS
    ):
        return ()
    return names


def _all_of(log: Path, request: ReplayRequest) -> list[Outcome]:
    return list(replay_log(log, request))


_opened: Mapping[Path, LogReplayer] = {}
"""In a worker that shares logs: the logs as the parent process prepared them."""


def _inherit(opened: Mapping[Path, LogReplayer]) -> None:
    global _opened
    _opened = opened


def _share_of(share: WorkPackage) -> dict[str, Outcome]:
    one = _opened[share.log]
    return {name: one.made(name) for name in share.strategies}
