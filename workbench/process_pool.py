"""How is work spread over processes of this machine? In a pool that ends with the process that made it.

Ctrl-C, an error or the end of this process, even by a kill, ends the workers at once: a stopped evaluation leaves
nothing behind that goes on computing.

Workers start afresh, which takes the second that imports take, or inherit what is loaded here (`inherit=True`), which
takes hundredths. Only a process that can be copied is: see `can_inherit`.
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

NOT_TO_BE_COPIED = ("libgomp", "libomp", "libiomp", "libtbb", "libtorch", "libarrow")
"""Libraries whose own threads a copy would wait for in vain. OpenBLAS, under NumPy and SciPy, ends its threads before
a fork and starts them again when they are needed."""


@contextmanager
def process_pool(
    workers: int, *, initializer: Callable[[], None] | None = None, inherit: bool = False
) -> Generator[ProcessPoolExecutor]:
    """A pool of processes; left in haste, it drops what is waiting and stops what is running.

    Args:
        workers: how many.
        initializer: what each worker does first.
        inherit: they inherit what is loaded here, where that can be done; all start with the first task.
    """
    context = get_context("fork" if inherit and can_inherit() else "spawn")
    pool = ProcessPoolExecutor(max_workers=workers, mp_context=context, initializer=_begin, initargs=(initializer,))
    before = _children()
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in _children() - before:
            process.terminate()
        raise
    pool.shutdown()


def can_inherit() -> bool:
    """Whether workers can be copies of this process: on Linux, and while nothing runs here besides this thread.

    A fork copies the calling thread alone; a lock that another one holds stays locked in the copy for ever. Whether
    there are others, Python knows of its own threads; of those of libraries, the libraries that are loaded tell.
    """
    if sys.platform != "linux" or threading.active_count() > 1:
        return False
    try:
        loaded = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return not any(name in loaded for name in NOT_TO_BE_COPIED)


def _children() -> frozenset[BaseProcess]:
    from multiprocessing import active_children

    return frozenset(active_children())


def _begin(initializer: Callable[[], None] | None) -> None:
    """In a worker: Ctrl-C is for the parent, which ends this one; when the parent is gone, so is this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if initializer is not None:
        initializer()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
