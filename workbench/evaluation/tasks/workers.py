"""Running many task trials on processes of this machine or on a Dask cluster; the rows are always the same."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

from workbench.evaluation.cluster import on_cluster
from workbench.evaluation.tasks.rows import TaskRow
from workbench.evaluation.tasks.trials import EventHook, TrialKey, prepare_trial, run_trial
from workbench.process_pool import one_thread_each, process_pool


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A trial and the strategies still to be run on it, each with its estimator."""

    key: TrialKey
    strategies: tuple[tuple[str, str], ...]
    assets: str = ""
    event_hook: EventHook | None = None
    miss_rate: float = 0.0
    sees_m: float = 0.0


def run_unit(unit: Unit) -> list[TaskRow]:
    """Run one trial with several strategies; executed by workers."""
    assets = Path(unit.assets) if unit.assets else None
    trial = prepare_trial(unit.key, assets=assets, miss_rate=unit.miss_rate, sees_m=unit.sees_m)
    return [
        run_trial(trial, name, estimator=estimator, event_hook=unit.event_hook) for name, estimator in unit.strategies
    ]


def run_units(units: list[Unit], *, workers: int, scheduler: str = "") -> Iterator[list[TaskRow]]:
    """Yield the rows of every unit, in the order of completion.

    Args:
        workers: number of processes; 1 runs in this process.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.

    Raises:
        MissingExtra, InputError, WorkerVersionDiffers, ClusterLost: as on_cluster, with a scheduler.
    """
    if scheduler:
        for _, rows in on_cluster(run_unit, units, scheduler=scheduler, workers=workers):
            yield rows
    elif workers <= 1:
        yield from (run_unit(unit) for unit in units)
    else:
        yield from _in_processes(units, workers)


def _in_processes(units: list[Unit], workers: int) -> Iterator[list[TaskRow]]:
    with one_thread_each(), process_pool(workers) as pool:
        for future in as_completed([pool.submit(run_unit, unit) for unit in units]):
            yield future.result()
