"""A ring buffer that keeps the last seconds in memory and saves them as a log on demand."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import final

from recorders.mcap_io.channels import ChannelSpec
from recorders.mcap_io.writer import McapWriter
from recorders.sinks.files import LogPart, RepeatedData, StoredMessage
from workbench.errors import BadValue
from workbench.log_schema.run_info import PART_METADATA

BUFFER_BYTES = 256 << 20


@final
class RingBuffer:
    """A Sink that keeps the last seconds, also bounded in bytes; thread-safe.

    Args:
        path: default output of `save`.
        keep_s: seconds of log time to keep.
        keep_bytes: limit on kept message data in bytes.
    """

    def __init__(self, path: Path | str, *, keep_s: float, keep_bytes: int = BUFFER_BYTES) -> None:
        if keep_s <= 0 or keep_bytes < 1:
            raise BadValue("ring buffer", (keep_s, keep_bytes), "of more than 0 s and 0 bytes")
        self._path = Path(path)
        self._keep_ns, self._keep_bytes = round(keep_s * 1e9), keep_bytes
        self._kept: deque[StoredMessage] = deque()
        self._bytes = 0
        self._newest_ns = 0
        self._standing = RepeatedData()
        self._lock = threading.Lock()

    @property
    def path(self) -> Path:
        return self._path

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        with self._lock:
            self._kept.append(StoredMessage(channel, data, log_time, publish_time))
            self._bytes += len(data)
            self._newest_ns = max(self._newest_ns, log_time)
            while self._kept and self._is_too_old():
                oldest = self._kept.popleft()
                self._bytes -= len(oldest.data)
                if oldest.channel.latched:
                    self._standing.latched[oldest.channel] = oldest
        return True

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        with self._lock:
            self._standing.attachments[name] = (media_type, data, log_time)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        with self._lock:
            self._standing.metadata[name] = dict(values)

    def flush(self) -> None:
        """Does nothing: data is written only by `save`."""

    def close(self) -> None:
        with self._lock:
            self._kept.clear()
            self._bytes = 0

    def save(self, path: Path | str | None = None, *, force: bool = False) -> Path:
        """Write the kept data as a self-contained log and return its path; recording continues meanwhile.

        Raises:
            OutputExists, CannotCreate, DiskFull: as for McapWriter.
        """
        with self._lock:
            kept = list(self._kept)
            standing = RepeatedData(
                attachments=dict(self._standing.attachments),
                metadata=dict(self._standing.metadata),
                latched=dict(self._standing.latched),
            )
        with McapWriter(path or self._path, force=force) as writer:
            part = LogPart(writer)
            writer.add_metadata(PART_METADATA, {"part": "0", "before": "", "last_s": f"{self._keep_ns / 1e9:g}"})
            standing.write_to(part, kept[0].log_time if kept else self._newest_ns)
            for message in kept:
                part.write(message)
        return writer.path

    def _is_too_old(self) -> bool:
        return self._bytes > self._keep_bytes or self._kept[0].log_time < self._newest_ns - self._keep_ns
