"""Reads ahead in a thread: reading, unpacking and checksums run beside packing and writing, and not before them."""

from __future__ import annotations

import ctypes
import queue
import threading
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from typing import TypeVar

from replayers.log_tools.whole_chunk import WholeChunk

T = TypeVar("T")
Item = tuple[int, T]
BATCH = 64
"""Items that are handed over together; a whole chunk ends a batch."""
AHEAD = 1
"""Batches that wait."""
MMAP_THRESHOLD, TRIM_THRESHOLD = -3, -1
"""Parameters of glibc's mallopt."""
REUSED_BYTES = 32 << 20
"""Blocks of memory up to this size, which is glibc's largest, are reused."""


def read_ahead(items: Iterator[Item[T]]) -> Iterator[Item[T]]:
    """Numbered items in their order, made in a thread, one batch ahead; what they raise is raised here.

    The thread ends with the last item, or with the iteration.
    """
    _reuse_memory()
    batches: queue.Queue[list[Item[T]] | None] = queue.Queue(AHEAD)
    stopped = threading.Event()
    failures: list[BaseException] = []

    def work() -> None:
        try:
            for batch in _batches(items):
                batches.put(batch)
                if stopped.is_set():
                    return
        except BaseException as error:  # noqa: BLE001 - raised again by the reader
            failures.append(error)
        batches.put(None)

    worker = threading.Thread(target=work, daemon=True, name="read ahead")
    worker.start()
    try:
        while (batch := batches.get()) is not None:
            yield from batch
        if failures:
            raise failures[0]
    finally:
        stopped.set()
        while worker.is_alive():
            _drop_one(batches)
        worker.join()


@cache
def _reuse_memory() -> None:
    """Makes glibc reuse the memory of a chunk for the next one.

    By default it takes new pages from the system for each, which costs more time than checksums and decompression.
    """
    with suppress(OSError, AttributeError, TypeError):  # another C library, or another system
        library = ctypes.CDLL(None)
        library.mallopt(MMAP_THRESHOLD, REUSED_BYTES)
        library.mallopt(TRIM_THRESHOLD, 2 * REUSED_BYTES)


def _batches(items: Iterator[Item[T]]) -> Iterator[list[Item[T]]]:
    batch: list[Item[T]] = []
    for item in items:
        batch.append(item)
        if isinstance(item[1], WholeChunk) or len(batch) == BATCH:
            yield batch
            batch = []
    if batch:
        yield batch


def _drop_one(batches: queue.Queue[list[Item[T]] | None]) -> None:
    with suppress(queue.Empty):
        batches.get(timeout=0.01)
