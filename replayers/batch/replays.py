"""Replay, comparison and the next look as functions with typed results, which the commands call too."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, final

import numpy as np

from replayers.batch.replay_all import LogFailed, Outcome, ReplayRequest, logs_among, replay_all, strategies_named
from replayers.batch.split_runs import join_first, parts_of_one_run
from replayers.batch.store import StoredReplay, replays_html, replays_in
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.counterfactual.sandbox import is_foreign, loaded_once, require_planner
from replayers.runs.run import Run
from workbench.errors import BadValue
from workbench.files import make_folder
from workbench.planning.strategies import StrategyNotLoaded
from workbench.plugins import NameOrigin
from workbench.remote.path import path_of
from workbench.terminal import counted

if TYPE_CHECKING:
    import pandas as pd

    from replayers.batch.compare import StrategyComparison
    from replayers.batch.next_look import ContainerLook

Progress = Callable[[Iterator[Outcome], int], Iterable[Outcome]]
"""Passes outcomes on as they are made, and knows how many there will be: a progress bar."""

BY_THE_LOG = ("log", "first")
"""Estimators that only a log has."""

Log = Run | Path | str
"""A run that was read, a log, or a folder of logs."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Replays:
    """Strategies replayed over logs. Iterating gives the replays, in the order of logs and then of strategies.

    Attributes:
        outcomes: every replay, and every log or strategy that could not be replayed.
        logs: the files that were replayed.
        settings: how.
        not_loaded: planners that could not be loaded, with the reasons.
    """

    outcomes: tuple[Outcome, ...]
    logs: tuple[Path, ...]
    settings: ReplaySettings
    not_loaded: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    def __iter__(self) -> Iterator[StoredReplay]:
        return iter([o for o in self.outcomes if isinstance(o, StoredReplay)])

    def _repr_html_(self) -> str:
        """A table of the replays, as a notebook shows it."""
        failed = f"{counted(len(self.failed), 'replay')} failed: see .failed" if self.failed else ""
        return replays_html(self, note=failed)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def failed(self) -> tuple[LogFailed, ...]:
        """What could not be replayed, with the reasons."""
        return tuple(o for o in self.outcomes if isinstance(o, LogFailed))

    @property
    def frame(self) -> pd.DataFrame:
        """One row for each replay: identity, status, bounds, estimate, support, seconds."""
        from replayers.batch.replay_tables import replays_frame

        return replays_frame(self)

    @property
    def steps(self) -> pd.DataFrame:
        """One row for each step of each run over its log alone."""
        from replayers.batch.replay_tables import steps_frame

        return steps_frame(self)


@final
class Comparisons(tuple["StrategyComparison", ...]):
    """Pairs of strategies, in a tuple that a notebook shows as a table."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        from replayers.batch.compare import comparisons_html

        return comparisons_html(self)


def replay(
    logs: Log | Sequence[Log],
    strategies: str | Sequence[str] = "all",
    *,
    settings: ReplaySettings | None = None,
    output: Path | str | None = None,
    worlds: Sequence[str] = (),
    workers: int | None = 1,
    scheduler: str = "",
    progress: Progress | None = None,
) -> Replays:
    """Replay strategies over logs, to know what they would have cost.

    Args:
        logs: one or several of a run, a log, a folder of logs and a pattern such as "logs/find-*.mcap".
        strategies: names, "module:Class" from the working folder, or "all".
        settings: the estimator, how many worlds are drawn, how far bounds are followed, and so on.
        output: the folder that keeps the replays and from which a second call resumes; None keeps nothing.
        worlds: with `output`, of "best", "worst" and "drawn", those in which the run is recorded besides.
        workers: processes; None for one for each core. Results do not depend on it.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.
        progress: wraps the outcomes, such as in a progress bar.

    Returns:
        Replays with bounds, estimates and steps. A log that cannot be replayed is in `failed`.

    Raises:
        FileMissing, MalformedFile: no such log, or no log in a folder.
        UnknownName: no such strategy or estimator.
        PluginNotLoaded: the estimator cannot be loaded.
        StrategyNotLoaded: none of the strategies can be loaded.
        FolderNotMade: the folder `output` cannot be made.
    """
    settings = settings or ReplaySettings()
    _require_estimator(settings)
    given = logs_among([_path(log) for log in _several(logs)])
    parts = parts_of_one_run(given)
    files = tuple(log for log in given if log not in parts)
    text = strategies if isinstance(strategies, str) else ",".join(strategies)
    named = strategies_named(text, with_truth=settings.with_truth)
    not_loaded = _not_loaded(named, settings)
    request = ReplayRequest(
        strategies=tuple(name for name in named if name not in not_loaded),
        settings=settings,
        output=Path(output) if output is not None else None,
        write_logs=output is not None,
        worlds=tuple(worlds),
        origin=NameOrigin.USER,
    )
    if scheduler and settings.in_process:
        raise BadValue("--scheduler", scheduler, "left out with --in-process, which runs a planner in this process")
    if request.output is not None:
        make_folder(request.output)
    made = replay_all(files, request, workers=1 if settings.in_process else workers, scheduler=scheduler)
    outcomes = list(progress(made, len(files) * len(request.strategies)) if progress else made)
    outcomes += [LogFailed(log=str(f), strategy=name, reason=why) for f in files for name, why in not_loaded.items()]
    outcomes += [LogFailed(log=str(part), strategy="", reason=join_first(part, of)) for part, of in parts.items()]
    return Replays(outcomes=tuple(outcomes), logs=files, settings=settings, not_loaded=MappingProxyType(not_loaded))


def compare(replays: Iterable[StoredReplay] | Path | str, *, rng: np.random.Generator | None = None) -> Comparisons:
    """Compare every pair of strategies that were replayed over the same logs, world by world.

    Where replays follow the beliefs of several estimators, each strategy is called STRATEGY by ESTIMATOR.

    Args:
        replays: of `replay`, or the folder that keeps them. A run that was replayed from several logs counts once.
        rng: draws houses for the intervals; None for seed 0.

    Raises:
        FileMissing: no such folder.
    """
    from replayers.batch.beliefs_apart import named_by_estimator
    from replayers.batch.breakdown import fewest_misses
    from replayers.batch.compare import compare as compare_records
    from replayers.batch.compare import runs_once

    records = replays_in(Path(replays)) if isinstance(replays, str | os.PathLike) else replays
    kept, _ = runs_once(fewest_misses(named_by_estimator(records)))
    return Comparisons(compare_records(kept, rng=rng or np.random.default_rng(0)))


def look_next(replays: Replays) -> tuple[ContainerLook, ...]:
    """For each log, the unopened container whose contents would settle most between the strategies replayed."""
    from replayers.batch.next_look import best_looks

    return best_looks(replays.outcomes, replays.logs, replays.settings)


def _several(logs: Log | Sequence[Log]) -> Sequence[Log]:
    return (logs,) if isinstance(logs, Run | str | Path) else logs


def _path(log: Log) -> Path:
    return log.path if isinstance(log, Run) else path_of(log)


def _require_estimator(settings: ReplaySettings) -> None:
    """Refuses an estimator that there is not before any log is blamed for it."""
    from workbench.beliefs.estimators import estimator

    if settings.estimator not in BY_THE_LOG:
        estimator(settings.estimator, origin=settings.estimator_origin, may_ask=False)


def _not_loaded(names: tuple[str, ...], settings: ReplaySettings) -> dict[str, str]:
    """Planners from outside that cannot be loaded, with the reasons.

    Raises:
        StrategyNotLoaded: there is no other strategy.
        BadValue: none is named; or two call themselves alike, so that no table could tell them apart.
    """
    if not names:
        raise BadValue("strategies", names, "at least one name")
    for name in names:
        require_planner(name)
    foreign = [name for name in names if is_foreign(name, origin=NameOrigin.USER)]
    in_process = settings.in_process
    loaded = {name: loaded_once(name, in_process=in_process) for name in foreign}
    found = {name: fault.reason for name, (_, fault) in loaded.items() if fault is not None}
    if len(found) == len(names):
        name, why = next(iter(found.items()))
        raise StrategyNotLoaded(name, why)
    by_own: dict[str, str] = {}
    for name, (own, fault) in loaded.items():
        if fault is None and by_own.setdefault(own, name) != name:
            wanted = f"strategies of different names: {by_own[own]} too calls itself {own!r}"
            raise BadValue("strategy", name, wanted)
    return found
