"""How is recording kept from ever holding up the robot? A thread writes; the caller only hands over.

The queue is bounded by bytes. When the disk cannot keep up, messages of ordinary channels are refused first, those
of important ones (decisions) only at twice the bound; what was refused is counted by topic and written into the log
as /recorder/dropped. When the disk is full, recording stops and the robot goes on: `on_trouble` tells.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import final

from recorders.channel_spec import ChannelSpec, json_channel
from recorders.sinks import Kept, Sink
from workbench.errors import Failed, LiosError
from workbench.runs.codec import encode
from workbench.runs.vocabulary import Dropped, Stamp
from workbench.terminal import say

QUEUE_BYTES = 64 << 20
SYNC_S = 1.0
GATHER_S = 0.02
"""How long the thread lets messages gather before it takes them."""
JOB_BYTES = 4096
"""What a job counts in the queue."""
Order = Kept | Callable[[], None]


class RecorderStopped(Failed):
    """The recording thread met an error that should not happen."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path}: recording stopped by an error in the recorder. What was flushed is kept.")


@final
class Background:
    """A Sink that hands everything to another sink, in a thread of its own. `write` neither blocks nor raises.

    Args:
        inner: what really writes; from now on only this thread touches it.
        queue_bytes: message data that may wait; important channels may use twice as much.
        sync_s: at least this often everything taken is on disk.
        on_trouble: told once, in words, when recording stops; by default a line on standard error.
        clock_ns: stamps of /recorder/dropped.

    Attributes:
        trouble: why recording stopped; None while it goes on.
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
        self.trouble: LiosError | None = None
        self._thread = threading.Thread(target=self._work, name="lios-recorder", daemon=True)
        self._thread.start()

    @property
    def path(self) -> Path:
        return self._inner.path

    @property
    def dropped(self) -> dict[str, int]:
        """Messages refused so far, by topic."""
        with self._lock:
            return dict(self._dropped)

    @property
    def waiting_bytes(self) -> int:
        """Handed over and not yet taken by the thread."""
        return self._waiting_bytes

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        """Hands over a message; False when it was refused and counted."""
        bound = self._queue_bytes * (2 if channel.important else 1)
        with self._lock:
            if self.trouble is not None or self._closing or self._waiting_bytes + len(data) > bound:
                self._dropped[channel.topic] = self._dropped.get(channel.topic, 0) + 1
                return False
            self._hand_over(Kept(channel, data, log_time, publish_time), len(data))
        return True

    def submit(self, job: Callable[[], None]) -> None:
        """Has the thread do a job between messages, in order; what the job writes, it writes to the inner sink."""
        with self._lock:
            if self.trouble is None and not self._closing:
                self._hand_over(job, JOB_BYTES)

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        self.submit(lambda: self._inner.attach(name, media_type, data, log_time=log_time))

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        kept = dict(values)
        self.submit(lambda: self._inner.describe(name, kept))

    def flush(self) -> None:
        """Has everything handed over so far brought to the disk at once; does not wait for it."""
        self._flush_wanted = True
        self._urgent.set()

    def wait(self, timeout_s: float = 60.0) -> bool:
        """Waits until all that was handed over is on disk; False when that took too long or recording stopped."""
        done = threading.Event()
        self.submit(lambda: (self._inner.flush(), done.set())[0])
        self._urgent.set()
        deadline = time.monotonic() + timeout_s
        while not done.wait(GATHER_S) and self.trouble is None and time.monotonic() < deadline:
            pass
        return done.is_set()

    def close(self) -> None:
        """Writes what waits, closes the inner sink and ends the thread. Safe to call twice."""
        self._closing = True
        self._urgent.set()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _hand_over(self, order: Order, size: int) -> None:
        self._queue.append((order, size))
        self._waiting_bytes += size
        if self._waiting_bytes > self._queue_bytes // 4:
            self._urgent.set()

    def _work(self) -> None:
        synced = time.monotonic()
        told: dict[str, int] = {}
        unsynced = finished = False
        try:
            while not finished:
                self._urgent.wait(GATHER_S)
                self._urgent.clear()
                closing, flush = self._closing, self._flush_wanted
                self._flush_wanted = False
                unsynced = self._take_all() or unsynced
                if (dropped := self.dropped) != told and (closing or time.monotonic() - synced >= self._sync_s):
                    self._tell_dropped(dropped)
                    told, unsynced = dropped, True
                if flush or (unsynced and time.monotonic() - synced >= self._sync_s):
                    self._inner.flush()
                    synced, unsynced = time.monotonic(), False
                if closing and not self._queue:
                    self._inner.close()
                    finished = True
        except LiosError as error:
            self._stop(error)
        finally:
            if (
                not finished and self.trouble is None
            ):  # a mistake of ours: threading prints it, nobody is left unaware
                self._stop(RecorderStopped(self._inner.path))

    def _take_all(self) -> bool:
        """Works off what is in the queue now; True when there was something."""
        count = len(self._queue)
        for _ in range(count):
            order, size = self._queue.popleft()
            if isinstance(order, Kept):
                self._inner.write(order.channel, order.data, log_time=order.log_time, publish_time=order.publish_time)
            else:
                order()
            with self._lock:
                self._waiting_bytes -= size
        return count > 0

    def _tell_dropped(self, counts: dict[str, int]) -> None:
        stamp_ns = self._clock_ns()
        event = Dropped(stamp=Stamp.of(stamp_ns), counts=dict(sorted(counts.items())))
        self._inner.write(json_channel(Dropped), encode(event), log_time=stamp_ns)

    def _stop(self, error: LiosError) -> None:
        with self._lock:
            self.trouble = error
            for order, _ in self._queue:
                if isinstance(order, Kept):
                    self._dropped[order.channel.topic] = self._dropped.get(order.channel.topic, 0) + 1
            self._queue.clear()
            self._waiting_bytes = 0
        with suppress(LiosError):
            self._inner.close()  # so that what was written has its index, where there is room for one
        self._on_trouble(str(error))
