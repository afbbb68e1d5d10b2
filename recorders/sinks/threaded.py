"""A sink that writes in its own thread, so that recording never blocks the robot.

The queue is bounded in bytes. If the disk cannot keep up, messages of ordinary channels are dropped first, those of
important ones (decisions) only at twice the bound; dropped messages are counted by topic and logged as
/recorder/dropped. If the disk is full, recording stops while the robot goes on, and `on_trouble` is called.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import final

from recorders.mcap_io.channels import ChannelSpec, json_channel
from recorders.sinks.files import Sink, StoredMessage
from workbench.errors import Failed, LiosError
from workbench.log_schema.codec import encode
from workbench.log_schema.events import Dropped, Stamp
from workbench.terminal import say

QUEUE_BYTES = 64 << 20
SYNC_S = 1.0
GATHER_S = 0.02
"""Time in seconds for which messages are collected before the thread takes them."""
JOB_BYTES = 4096
"""Size of a job in the queue, in bytes."""
Order = StoredMessage | Callable[[], None]


class RecorderStopped(Failed):
    """The recording thread stopped with an unexpected error."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path}: recording stopped by an error in the recorder. What was flushed is kept.")


@final
class ThreadedSink:
    """A Sink that passes everything to another sink in its own thread. `write` neither blocks nor raises.

    Args:
        inner: the sink that writes; from now on used only by this thread.
        queue_bytes: limit on queued message data in bytes; important channels may use twice as much.
        sync_s: longest time in seconds between syncs to disk.
        on_trouble: called once with a message if recording stops; by default it prints to standard error.
        clock_ns: time source for the stamps of /recorder/dropped.

    Attributes:
        trouble: why recording stopped; None while it runs.
    """

    def __init__(
        self,
        inner: Sink,
        *,
        queue_bytes: int = QUEUE_BYTES,
        sync_s: float = SYNC_S,
        on_trouble: Callable[[str], None] = say,
        clock_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        self._inner = inner
        self._queue_bytes, self._sync_s = queue_bytes, sync_s
        self._on_trouble, self._clock_ns = on_trouble, clock_ns
        self._queue: deque[tuple[Order, int]] = deque()
        self._waiting_bytes = 0
        self._dropped: dict[str, int] = {}
        self._lock = threading.Lock()
        self._urgent = threading.Event()
        self._flush_wanted = False
        self._closing = False
        self.stop_reason: LiosError | None = None
        self._thread = threading.Thread(target=self._work, name="lios-recorder", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path:
        return self._inner.path

    @property
    def dropped(self) -> dict[str, int]:
        """Number of messages dropped so far, by topic."""
        with self._lock:
            return dict(self._dropped)

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        """Queue a message; False if it was dropped and counted."""
        bound = self._queue_bytes * (2 if channel.important else 1)
        with self._lock:
            if self.stop_reason is not None or self._closing or self._waiting_bytes + len(data) > bound:
                self._dropped[channel.topic] = self._dropped.get(channel.topic, 0) + 1
                return False
            self._enqueue(StoredMessage(channel, data, log_time, publish_time), len(data))
        return True

    def submit(self, job: Callable[[], None]) -> None:
        """Queue a job that the thread executes between messages, in order; it writes to the inner sink."""
        with self._lock:
            if self.stop_reason is None and not self._closing:
                self._enqueue(job, JOB_BYTES)

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        self.submit(lambda: self._inner.attach(name, media_type, data, log_time=log_time))

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        kept = dict(values)
        self.submit(lambda: self._inner.describe(name, kept))

    def flush(self) -> None:
        """Request that everything queued so far is synced to disk soon; does not wait for it."""
        self._flush_wanted = True
        self._urgent.set()

    def wait(self, timeout_s: float = 60.0) -> bool:
        """Wait until everything queued is on disk; False after a timeout or if recording stopped."""
        done = threading.Event()
        self.submit(lambda: (self._inner.flush(), done.set())[0])
        self._urgent.set()
        deadline = time.monotonic() + timeout_s
        while not done.wait(GATHER_S) and self.stop_reason is None and time.monotonic() < deadline:
            pass
        return done.is_set()

    def close(self) -> None:
        """Write the rest of the queue, close the inner sink and end the thread. Safe to call twice."""
        self._closing = True
        self._urgent.set()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _enqueue(self, order: Order, size: int) -> None:
        self._queue.append((order, size))
        self._waiting_bytes += size
        if self._waiting_bytes > self._queue_bytes // 4:
            self._urgent.set()

    def _work(self) -> None:
        synced = time.monotonic()
        reported: dict[str, int] = {}
        unsynced = finished = False
        try:
            while not finished:
                self._urgent.wait(GATHER_S)
                self._urgent.clear()
                closing, flush = self._closing, self._flush_wanted
                self._flush_wanted = False
                unsynced = self._drain_queue() or unsynced
                if (dropped := self.dropped) != reported and (closing or time.monotonic() - synced >= self._sync_s):
                    self._write_dropped(dropped)
                    reported, unsynced = dropped, True
                if flush or (unsynced and time.monotonic() - synced >= self._sync_s):
                    self._inner.flush()
                    synced, unsynced = time.monotonic(), False
                if closing and not self._queue:
                    self._inner.close()
                    finished = True
        except LiosError as error:
            self._stop(error)
        finally:
            if not finished and self.stop_reason is None:
                # a programming error: report it, and let threading print it
                self._stop(RecorderStopped(self._inner.path))

    def _drain_queue(self) -> bool:
        """Process everything in the queue now; True if there was anything."""
        count = len(self._queue)
        for _ in range(count):
            order, size = self._queue.popleft()
            if isinstance(order, StoredMessage):
                self._inner.write(order.channel, order.data, log_time=order.log_time, publish_time=order.publish_time)
            else:
                order()
            with self._lock:
                self._waiting_bytes -= size
        return count > 0

    def _write_dropped(self, counts: dict[str, int]) -> None:
        stamp_ns = self._clock_ns()
        event = Dropped(stamp=Stamp.of(stamp_ns), counts=dict(sorted(counts.items())))
        self._inner.write(json_channel(Dropped), encode(event), log_time=stamp_ns)

    def _stop(self, error: LiosError) -> None:
        with self._lock:
            self.stop_reason = error
            for order, _ in self._queue:
                if isinstance(order, StoredMessage):
                    self._dropped[order.channel.topic] = self._dropped.get(order.channel.topic, 0) + 1
            self._queue.clear()
            self._waiting_bytes = 0
        with suppress(LiosError):
            self._inner.close()  # so that the written data gets its index, if there is room for one
        self._on_trouble(str(error))
