"""A log read while it is being recorded: each reading takes up only what was added since the last one.

Records that are whole on disk are read; what is still being written is left for the next reading. Once the log is
closed, or where it was replaced or its records do not add up, it is read again from its start.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, final

from mcap.opcode import Opcode

from recorders.mcap_io.index import MAGIC
from replayers.mcap_io.messages import ChunkMessages
from replayers.mcap_io.records import HEAD, MAX_RECORD_BYTES
from replayers.mcap_io.scan import open_log, record_at
from replayers.mcap_io.summary import is_closed
from replayers.runs.run import Run, RunBuilder, read

TAKEN = frozenset(
    int(opcode)
    for opcode in (
        Opcode.CHUNK,
        Opcode.MESSAGE,
        Opcode.SCHEMA,
        Opcode.CHANNEL,
        Opcode.ATTACHMENT,
        Opcode.METADATA,
    )
)
"""Opcodes of what a run is made of; other records are passed over unread."""
HASH_BLOCK_BYTES = 1 << 20
FIRST_BYTES = 4096
"""How much of a log's beginning, which names the run, is compared to recognise it."""


@final
class GrowingLog:
    """One log that may still grow.

    Args:
        path: the log; it need not exist yet.

    Attributes:
        end: how many of its bytes were read; records before it are whole.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._state: tuple[int, ...] = ()
        self._begin()

    def read(self) -> Run | None:
        """The run as far as it is on disk; None where nothing was added since the last reading.

        Raises:
            FileMissing, NoMcap: no file, or no MCAP file.
            NoRunInLog: the run's identity, place or task is not on disk yet, or it is no log of a run.
            SeveralRuns, UndecodableMessage, NewerSchema: as `replayers.read`.
        """
        with open_log(self.path) as stream:
            size = stream.seek(0, io.SEEK_END)
            state = (size, *_written(self.path))
            if state == self._state:
                return None
            if size < self.end or not self._begins_alike(stream):
                self._begin()
            self._state = state
            if is_closed(stream):
                return read(self.path)
            self._take(stream, size)
            stream.seek(0)
            self._first = stream.read(min(self.end, FIRST_BYTES))
        return self._found.run(closed=False, sha256_read=self._digest.copy().hexdigest())

    def _begin(self) -> None:
        self.end = len(MAGIC)
        self._first = b""
        self._found = RunBuilder(self.path, with_truth=False)
        self._content = ChunkMessages(topics=self._found.wants, on_damage=self._found.damage.append)
        self._digest = hashlib.sha256(MAGIC)

    def _begins_alike(self, stream: BinaryIO) -> bool:
        """Whether the file still begins as what was read of it, and is not another one under its name."""
        stream.seek(0)
        return stream.read(len(self._first)) == self._first

    def _take(self, stream: BinaryIO, size: int) -> None:
        for offset, opcode, end in _whole_records(stream, self.end, size):
            self._hash(stream, offset, end)
            self.end = end
            if opcode in TAKEN:
                record = record_at(stream, offset, on_damage=self._found.damage.append)
                self._found.take(record)
                self._found.extend(self._content.messages_of(offset, record))

    def _hash(self, stream: BinaryIO, offset: int, end: int) -> None:
        stream.seek(offset)
        while offset < end:
            block = stream.read(min(HASH_BLOCK_BYTES, end - offset))
            self._digest.update(block)
            offset += len(block)


def _written(path: Path) -> tuple[int, ...]:
    """When a local file was written, and which one it is."""
    try:
        status = path.stat()
    except OSError:
        return ()
    return status.st_mtime_ns, status.st_ino


def _whole_records(stream: BinaryIO, offset: int, size: int) -> Iterator[tuple[int, int, int]]:
    """Offset, opcode and end of every record from an offset on that is whole within a size."""
    while offset + HEAD.size <= size:
        stream.seek(offset)
        opcode, length = HEAD.unpack(stream.read(HEAD.size))
        end = offset + HEAD.size + length
        if opcode == 0 or length > MAX_RECORD_BYTES or end > size:
            return
        yield offset, opcode, end
        offset = end
