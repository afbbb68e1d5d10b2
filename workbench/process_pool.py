"""A pool of worker processes that ends with the process that made it.

Ctrl-C, an error or the death of the parent, even by a kill, ends the workers at once: a stopped evaluation leaves
no process running.

Workers are spawned, which takes about a second of imports, or forked with all loaded modules (`inherit=True`),
which takes hundredths of a second. A process is forked only when that is safe: see `can_inherit`.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process
from multiprocessing.process import BaseProcess
from pathlib import Path

FORK_UNSAFE_LIBRARIES = ("libgomp", "libomp", "libiomp", "libtbb", "libtorch", "libarrow")
"""Libraries with thread pools that do not survive a fork. OpenBLAS, used by NumPy and SciPy, is not among them: it
ends its threads before a fork and restarts them on demand."""


THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables by which libraries take fewer threads than there are cores."""


@contextmanager
def process_pool(
    workers: int, *, initializer: Callable[[], None] | None = None, inherit: bool = False
) -> Generator[ProcessPoolExecutor]:
    """A pool of processes as a context manager; when left by an exception, it cancels pending tasks and stops
    running ones.

    Args:
        workers: number of processes.
        initializer: called first in each worker.
        inherit: fork the workers where that is safe, so that they share all loaded modules; all start with the
            first task.
    """
    context = get_context("fork" if inherit and can_inherit() else "spawn")
    pool = ProcessPoolExecutor(
        max_workers=workers, mp_context=context, initializer=_init_worker, initargs=(initializer,)
    )
    before = _children()
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in _children() - before:
            process.terminate()
        raise
    pool.shutdown()


@contextmanager
def one_thread_each(*, whatever_is_set: bool = False) -> Generator[None]:
    """Processes that are started meanwhile use one thread each: many processes with many threads are slower than many
    processes.

    Args:
        whatever_is_set: also where the user's environment gives another number.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update({name: "1" if whatever_is_set or value is None else value for name, value in before.items()})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def can_inherit() -> bool:
    """Whether forking is safe: on Linux, and while no other thread runs in this process.

    A fork copies only the calling thread; a lock held by another thread stays locked in the copy for ever. Python
    reports its own threads; those of native libraries are inferred from which libraries are loaded.
    """
    if sys.platform != "linux" or threading.active_count() > 1:
        return False
    try:
        loaded = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return not any(name in loaded for name in FORK_UNSAFE_LIBRARIES)


def _children() -> frozenset[BaseProcess]:
    from multiprocessing import active_children

    return frozenset(active_children())


def end_with_parent() -> None:
    """Runs in a child process: leaves Ctrl-C to the parent, which ends the child, and exits when the parent is
    gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_exit_with_parent, daemon=True).start()


def _init_worker(initializer: Callable[[], None] | None) -> None:
    end_with_parent()
    if initializer is not None:
        initializer()


def _exit_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
