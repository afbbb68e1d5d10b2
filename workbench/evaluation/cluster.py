"""Runs units of work in this process, on processes of this machine or on a Dask cluster; results are always the same.

On a cluster units of workers that died are run again, and while no worker is there the command says so and waits.
"""

from __future__ import annotations

import logging
import os
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from multiprocessing import current_process
from typing import Any, NamedTuple, TypeVar, cast

from workbench import __version__
from workbench.errors import Failed, InputError, MissingExtra
from workbench.process_pool import one_thread_each, process_pool
from workbench.terminal import say

Unit = TypeVar("Unit")
Result = TypeVar("Result")

RETRIES = 5
"""Number of retries of a unit whose worker died."""
LOOK_EVERY_S = 5.0
"""Interval in seconds between checks for workers."""
QUEUED_PER_WORKER = 3
"""Units queued for each worker; this bounds the memory for long lists of units."""
NOT_INSTALLED = "0.0.0"
"""The version of a source tree that was never installed."""
MIN_AHEAD = 64
"""Minimum number of units handed out on a cluster: workers may join later."""
LOCAL_SETTINGS = {
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.tick.limit": "1 min",
    "distributed.admin.system-monitor.interval": "5s",
}
"""Dask's settings for a cluster of this machine. Units take seconds: a worker that holds one more than it works on
would keep it from an idle one. Nobody looks at Dask's profile, which samples a worker a hundred times a second; with
the other clocks it takes 2 % of a core for each process, and 0.3 % so."""


class ClusterLost(Failed):
    """The connection to a Dask cluster was lost, or its workers died too often on one unit."""

    def __init__(self, scheduler: str, error: BaseException) -> None:
        super().__init__(
            f"the Dask cluster at {scheduler} was lost ({type(error).__name__}). "
            "Finished work is kept in -o: start the cluster and run the same command again."
        )


class WorkerVersionDiffers(InputError):
    """A worker has another version of this package, and could give other results."""

    def __init__(self, worker: str, version: str) -> None:
        super().__init__(
            f"the Dask worker {worker} has lios-workbench {version}, this machine {__version__}. "
            "Install the same version on both."
        )


class WorkerImportFailed(InputError):
    """A worker cannot import what the work needs."""

    def __init__(self, scheduler: str, error: ImportError) -> None:
        super().__init__(
            f"a Dask worker of {scheduler} cannot import what this needs ({error}). "
            f"Install lios-workbench {__version__} there."
        )


class FolderNotShared(InputError):
    """A worker does not see the folder in which the command was given."""

    def __init__(self, folder: str) -> None:
        super().__init__(f"a Dask worker has no folder {folder}: files and planners must be in a shared one.")


class Workforce(NamedTuple):
    """Who does the work: processes here, or a Dask cluster: the arguments of run_in_order."""

    workers: int = 1
    scheduler: str = ""


def run_in_order(
    work: Callable[[Unit], Result], units: Iterable[Unit], *, workers: int = 1, scheduler: str = ""
) -> Iterator[Result]:
    """Yield the results of all units in their order, for any number of workers. Units are taken as they are needed.

    Args:
        work: a function of a module; units and results are pickled where other processes work.
        workers: number of processes; 1 works in this one.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.

    Raises:
        As on_cluster, with a scheduler.
    """
    if scheduler:
        yield from in_order_on_cluster(work, units, scheduler=scheduler, workers=workers)
    elif workers <= 1:
        yield from map(work, units)
    else:
        with one_thread_each(), process_pool(workers) as pool:
            waiting: deque[Future[Result]] = deque()
            for unit in units:
                waiting.append(pool.submit(work, unit))
                if len(waiting) >= workers * QUEUED_PER_WORKER:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()


def in_order_on_cluster(
    work: Callable[[Unit], Result], units: Iterable[Unit], *, scheduler: str, workers: int
) -> Iterator[Result]:
    """Yield the results of all units in their order; as on_cluster otherwise.

    Workers work in the folder in which the command was given: names of files, and plug-ins from the working folder,
    mean the same there.

    Raises:
        FolderNotShared: a worker does not see that folder.
    """
    early: dict[int, Result] = {}
    due = 0
    here = partial(_in_folder, os.getcwd(), work)
    for index, result in on_cluster(here, units, scheduler=scheduler, workers=workers):
        early[index] = result
        while due in early:
            yield early.pop(due)
            due += 1


def _in_folder(folder: str, work: Callable[[Unit], Result], unit: Unit) -> Result:
    try:
        os.chdir(folder)
    except OSError as error:
        raise FolderNotShared(folder) from error
    return work(unit)


def on_cluster(
    work: Callable[[Unit], Result], units: Iterable[Unit], *, scheduler: str, workers: int
) -> Iterator[tuple[int, Result]]:
    """Yield each unit's index and result, in the order of completion.

    Args:
        work: a function of a module that workers can import; units and results are pickled.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.

    Raises:
        MissingExtra: dask.distributed is not installed.
        InputError: the scheduler does not answer.
        WorkerVersionDiffers, WorkerImportFailed: a worker has another version of this package, or none.
        ClusterLost: the connection to the scheduler was lost.
    """
    try:
        import distributed
        from distributed.comm.core import CommClosedError
    except ImportError as error:
        raise MissingExtra("a Dask cluster", "cluster") from error
    lost = (CancelledError, distributed.KilledWorker, CommClosedError)
    with (
        one_thread_each(),
        _client(distributed, scheduler, workers) as client,
        _warning_without_workers(client, scheduler),
    ):
        _require_same_version(client, scheduler)
        numbered = enumerate(units)

        def handed_out(count: int) -> list[Any]:
            return [hand_out(number, unit) for number, unit in islice(numbered, count)]

        def hand_out(number: int, unit: Unit) -> Any:
            future = client.submit(partial(_worked, work), unit, pure=False, retries=RETRIES)
            index[future.key] = number
            return future

        index: dict[str, int] = {}
        done = distributed.as_completed(handed_out(max(MIN_AHEAD, QUEUED_PER_WORKER * _threads(client))))
        for future in done:
            try:
                found, worker, result = future.result()
            except lost as error:
                logging.getLogger("distributed").setLevel(logging.CRITICAL)  # it would log every unit
                raise ClusterLost(scheduler, error) from error
            except ImportError as error:
                raise WorkerImportFailed(scheduler, error) from error
            if found != __version__:
                raise WorkerVersionDiffers(worker, found)
            done.update(handed_out(1))
            yield index.pop(future.key), result


def _threads(client: Any) -> int:
    return sum(client.nthreads().values())


def _require_same_version(client: Any, scheduler: str) -> None:
    """Check the workers that are connected; those that join later report their version with each result.

    The check calls a function of the standard library, which every version of this package has.
    """
    try:
        found: dict[str, str] = client.run(version, "lios-workbench")
    except PackageNotFoundError as error:
        if __version__ == NOT_INSTALLED:
            return
        raise WorkerImportFailed(scheduler, error) from error
    for worker, there in found.items():
        if there != __version__:
            raise WorkerVersionDiffers(worker, there)


def _worked(work: Callable[[Unit], Result], unit: Unit) -> tuple[str, str, Result]:
    """Runs on a worker: the version of this package there, the worker, and the result.

    Dask makes its workers daemons, which may not start processes; a user's planner has a separate process, for its
    time limit, and that one ends with the worker.
    """
    process = current_process()
    cast(Any, process)._config["daemon"] = False
    return __version__, process.name, work(unit)


@contextmanager
def _client(distributed: Any, scheduler: str, workers: int) -> Generator[Any]:
    if scheduler == "local":
        from dask import config

        with (
            config.set(LOCAL_SETTINGS),
            distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
            ) as cluster,
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
def _warning_without_workers(client: Any, scheduler: str) -> Generator[None]:
    """A context that reports when no worker is left, and when there are workers again."""
    ended = threading.Event()

    def watch() -> None:
        there = True
        while not ended.wait(LOOK_EVERY_S):
            try:
                now = bool(client.scheduler_info()["workers"])
            except (OSError, ValueError, RuntimeError, KeyError, TimeoutError):
                return  # the scheduler is gone; collecting the results reports that
            if now != there:
                say("Workers are available again." if now else f"No worker is at {scheduler}: waiting for one.")
            there = now

    watcher = threading.Thread(target=watch, name="workers", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join(timeout=LOOK_EVERY_S)
