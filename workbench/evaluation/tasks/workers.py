"""Running many task trials on processes of this machine or on a Dask cluster; the rows are always the same."""

from __future__ import annotations

import logging
import os
from collections.abc import Generator, Iterator
from concurrent.futures import CancelledError, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import Failed, InputError, MissingExtra
from workbench.evaluation.tasks.rows import TaskRow
from workbench.evaluation.tasks.trials import EventHook, TrialKey, prepare_trial, run_trial
from workbench.process_pool import process_pool

RETRIES = 5
"""Number of retries of a Dask unit whose worker died."""


class ClusterLost(Failed):
    """The connection to a Dask cluster was lost, or its workers died too often on one trial."""

    def __init__(self, scheduler: str, error: BaseException) -> None:
        super().__init__(
            f"the Dask cluster at {scheduler} was lost ({type(error).__name__}). "
            "What is done is kept in -o: start the cluster and give the same command again."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A trial and the strategies still to be run on it, each with its estimator."""

    key: TrialKey
    strategies: tuple[tuple[str, str], ...]
    assets: str = ""
    tap: EventHook | None = None


def run_unit(unit: Unit) -> list[TaskRow]:
    """Run one trial with several strategies; executed by workers."""
    staged = prepare_trial(unit.key, assets=Path(unit.assets) if unit.assets else None)
    return [run_trial(staged, name, estimator=believer, tap=unit.tap) for name, believer in unit.strategies]


def run_units(units: list[Unit], *, workers: int, scheduler: str = "") -> Iterator[list[TaskRow]]:
    """Yield the rows of every unit, in the order of completion.

    Args:
        workers: number of processes; 1 runs in this process.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.

    Raises:
        MissingExtra: a scheduler is given, but dask.distributed is not installed.
        InputError: the scheduler does not answer.
        ClusterLost: the connection to the scheduler was lost.
    """
    if scheduler:
        yield from _on_dask(units, scheduler, workers)
    elif workers <= 1:
        yield from (run_unit(unit) for unit in units)
    else:
        yield from _in_processes(units, workers)


def _in_processes(units: list[Unit], workers: int) -> Iterator[list[TaskRow]]:
    with _one_thread_each(), process_pool(workers) as pool:
        for future in as_completed([pool.submit(run_unit, unit) for unit in units]):
            yield future.result()


def _on_dask(units: list[Unit], scheduler: str, workers: int) -> Iterator[list[TaskRow]]:
    try:
        import distributed
        from distributed.comm.core import CommClosedError
    except ImportError as error:
        raise MissingExtra("a Dask cluster", "cluster") from error
    lost = (CancelledError, distributed.KilledWorker, CommClosedError)
    with _one_thread_each(), _client(distributed, scheduler, workers) as client:
        futures = [client.submit(run_unit, unit, pure=False, retries=RETRIES) for unit in units]
        for future in distributed.as_completed(futures):
            try:
                rows = future.result()
            except lost as error:
                logging.getLogger("distributed").setLevel(logging.CRITICAL)  # it would log every trial
                raise ClusterLost(scheduler, error) from error
            yield rows


@contextmanager
def _client(distributed: Any, scheduler: str, workers: int) -> Generator[Any]:
    if scheduler == "local":
        with (
            distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = distributed.Client(scheduler, timeout="15s")
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}. Start one: dask scheduler") from error
    with client:
        yield client


@contextmanager
def _one_thread_each() -> Generator[None]:
    """Workers use one thread each: many processes with many threads are slower than many processes."""
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update({name: os.environ.get(name, "1") for name in names})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
