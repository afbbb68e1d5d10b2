"""Reads files at addresses by ranges: small requests for random access, larger ones for sequential reading."""

from __future__ import annotations

import io
from typing import Any, final

from workbench.caches import Cache
from workbench.remote.errors import RangesUnsupported, TransferInterrupted, Unreachable, in_words, outside_errors
from workbench.remote.path import RemotePath

BLOCK_BYTES = 16 << 10
TAIL_BLOCKS = 4
"""How much is read at once of the end of a file, where the index of a log stands."""
MAX_AHEAD = 512
"""Most blocks of one request: 8 MiB."""
MAX_KEPT = 4096
"""Most blocks that are kept: 64 MiB."""


def open_remote(path: RemotePath) -> RemoteFile:
    """Opens a file at an address; nothing but its size is read.

    Raises:
        FileMissing, NoCredentials, Unreachable: as the store answers.
        RangesUnsupported: the server says that it sends no parts of files.
    """
    files = path.filesystem()
    try:
        source = files.open(str(path), "rb", block_size=BLOCK_BYTES, cache_type="none")
        if not source.seekable():
            source.close()
            raise RangesUnsupported(path)
    except outside_errors() as error:
        raise in_words(error, path) from error
    return RemoteFile(source, path)


@final
class RemoteFile(io.BufferedIOBase):
    """A file at an address, as a stream that can be sought.

    Its bytes are fetched in blocks, which are kept. A read that goes on where the last request ended doubles the
    number of blocks of a request, and one that jumps starts again with one block.
    """

    def __init__(self, source: Any, path: RemotePath) -> None:
        super().__init__()
        self._source, self._path = source, path
        self._size = _size_of(source, path)
        self._at = 0
        self._blocks: Cache[int, bytes] = Cache(MAX_KEPT)
        self._next, self._ahead = 0, 1

    @property
    def name(self) -> str:
        return str(self._path)

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._size}[whence]
        self._at = max(start + offset, 0)
        return self._at

    def read(self, size: int | None = -1, /) -> bytes:
        """Bytes from the present place.

        Raises:
            TransferInterrupted, RangesUnsupported, Unreachable: they cannot be fetched.
        """
        left = max(self._size - self._at, 0)
        wanted = left if size is None or size < 0 else min(size, left)
        if wanted > MAX_AHEAD * BLOCK_BYTES:
            data = self._fetch(self._at, self._at + wanted)
        else:
            data = self._from_blocks(self._at, self._at + wanted) if wanted else b""
        self._at += len(data)
        return data

    def read1(self, size: int = -1, /) -> bytes:
        return self.read(BLOCK_BYTES if size < 0 else size)

    def readinto(self, buffer: Any, /) -> int:
        view = memoryview(buffer).cast("B")
        data = self.read(len(view))
        view[: len(data)] = data
        return len(data)

    def close(self) -> None:
        if not self.closed:
            self._source.close()
        super().close()

    def _from_blocks(self, start: int, end: int) -> bytes:
        first, last = start // BLOCK_BYTES, (end - 1) // BLOCK_BYTES
        kept = {number: self._blocks.find(number) for number in range(first, last + 1)}
        missing = [number for number, block in kept.items() if block is None]
        new = self._fill(missing[0], missing[-1]) if missing else {}
        data = b"".join(new.get(number, block or b"") for number, block in kept.items())
        return data[start - first * BLOCK_BYTES : end - first * BLOCK_BYTES]

    def _fill(self, first: int, last: int) -> dict[int, bytes]:
        """Fetches blocks first to last, and some after them."""
        self._ahead = min(self._ahead * 2, MAX_AHEAD) if first == self._next else 1
        beyond = -(-self._size // BLOCK_BYTES)
        stop = min(max(last + 1, first + self._ahead), beyond)
        if stop >= beyond - 1 and self._ahead == 1:
            first = max(min(first, beyond - TAIL_BLOCKS), 0)
        data = self._fetch(first * BLOCK_BYTES, min(stop * BLOCK_BYTES, self._size))
        begins = ((number, (number - first) * BLOCK_BYTES) for number in range(first, stop))
        new = {number: data[begin : begin + BLOCK_BYTES] for number, begin in begins}
        for number, block in new.items():
            self._blocks.put(number, block)
        self._next = stop
        return new

    def _fetch(self, start: int, end: int) -> bytes:
        for last_try in (False, True):
            try:
                self._source.seek(start)
                data = self._source.read(end - start)
            except outside_errors() as error:
                explained = in_words(error, self._path)
                if not isinstance(explained, Unreachable):
                    raise explained from error
                if last_try:
                    raise TransferInterrupted(self._path, start) from error
            else:
                if len(data) == end - start:
                    return data
        raise TransferInterrupted(self._path, start)


def _size_of(source: Any, path: RemotePath) -> int:
    try:
        return int(source.seek(0, io.SEEK_END))
    except outside_errors() as error:
        raise in_words(error, path) from error
