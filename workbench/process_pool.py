"""How is work spread over processes of this machine? In a pool that ends with the process that made it.

Ctrl-C, an error or the end of this process, even by a kill, ends the workers at once: a stopped evaluation leaves
nothing behind that goes on computing.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process
from multiprocessing.process import BaseProcess


@contextmanager
def process_pool(workers: int, *, initializer: Callable[[], None] | None = None) -> Generator[ProcessPoolExecutor]:
    """A pool of freshly started processes; left in haste, it drops what is waiting and stops what is running.

    Args:
        workers: how many.
        initializer: what each worker does first.
    """
    pool = ProcessPoolExecutor(
        max_workers=workers, mp_context=get_context("spawn"), initializer=_begin, initargs=(initializer,)
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


def _children() -> frozenset[BaseProcess]:
    from multiprocessing import active_children

    return frozenset(active_children())


def _begin(initializer: Callable[[], None] | None) -> None:
    """In a worker: Ctrl-C is for the parent, which ends this one; when the parent is gone, so is this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if initializer is not None:
        initializer()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
