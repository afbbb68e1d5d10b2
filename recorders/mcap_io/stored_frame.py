"""zstd frames that store their content as it is, as encoders do with pictures: one pass gives both checksums.

What was stored in one log is stored again in a copy, without another attempt to compress it.

Format: RFC 8878, sections 3.1.1.1 and 3.1.1.2.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import NamedTuple

from recorders.mcap_io.crc32 import combined_crc

MAGIC = b"\x28\xb5\x2f\xfd"
SINGLE_SEGMENT = 0b0010_0000
SIZE_BYTES = (1, 2, 4, 8)
"""Length of the content's size, by the two highest bits of the frame's descriptor; 256 is added to one of 2 bytes."""
MAX_BLOCK_BYTES = 128 << 10
RAW_BLOCK = 0


class StoredFrame(NamedTuple):
    """A frame that stores its content as it is.

    Attributes:
        blocks: where the content of each block begins and ends in the frame, and its checksum.
        crc: checksum of the content.
    """

    frame: memoryview
    blocks: Sequence[tuple[int, int, int]]
    crc: int

    def content(self) -> bytes:
        """What is stored, copied."""
        return b"".join([self.frame[start:end] for start, end, _ in self.blocks])

    @property
    def content_bytes(self) -> int:
        """Length of what is stored."""
        return sum(end - start for start, end, _ in self.blocks)

    def frame_crc(self) -> int:
        """Checksum of the frame itself, from those of its blocks."""
        crc = at = 0
        for start, end, block in self.blocks:
            crc = combined_crc(zlib.crc32(self.frame[at:start], crc), block, end - start)
            at = end
        return crc


def stored_frame(frame: bytes | bytearray | memoryview) -> StoredFrame | None:
    """Reads a single frame whose blocks are all stored, without dictionary and checksum; None for any other."""
    frame = memoryview(frame)
    spans = _stored_blocks(frame)
    if spans is None:
        return None
    blocks: list[tuple[int, int, int]] = []
    crc = 0
    for start, end in spans:
        block = zlib.crc32(frame[start:end])
        blocks.append((start, end, block))
        crc = combined_crc(crc, block, end - start)
    return StoredFrame(frame, blocks, crc)


def store(content: bytes | bytearray) -> StoredFrame:
    """A frame that stores its content as it is, as zstd itself makes them of what it cannot compress."""
    view, size = memoryview(content), len(content)
    parts: list[bytes | memoryview] = [MAGIC, bytes([SINGLE_SEGMENT | 0b1000_0000]), size.to_bytes(4, "little")]
    blocks: list[tuple[int, int, int]] = []
    crc, at = 0, sum(map(len, parts))
    for begin in range(0, max(size, 1), MAX_BLOCK_BYTES):
        block = view[begin : begin + MAX_BLOCK_BYTES]
        last = begin + MAX_BLOCK_BYTES >= size
        parts += [(last | RAW_BLOCK << 1 | len(block) << 3).to_bytes(3, "little"), block]
        found = zlib.crc32(block)
        blocks.append((at + 3, at + 3 + len(block), found))
        crc, at = combined_crc(crc, found, len(block)), at + 3 + len(block)
    return StoredFrame(memoryview(b"".join(parts)), blocks, crc)


def _stored_blocks(frame: memoryview) -> list[tuple[int, int]] | None:
    """Where the blocks' content begins and ends; None where a block is compressed, or anything is unusual."""
    if len(frame) < 6 or bytes(frame[:4]) != MAGIC or frame[4] & ~0b1100_0000 != SINGLE_SEGMENT:
        return None
    size_bytes = SIZE_BYTES[frame[4] >> 6]
    at = 5 + size_bytes
    size = int.from_bytes(frame[5:at], "little") + (256 if size_bytes == 2 else 0)
    spans: list[tuple[int, int]] = []
    last = False
    while not last:
        head = int.from_bytes(frame[at : at + 3], "little")
        last, kind, length = bool(head & 1), head >> 1 & 3, head >> 3
        start, at = at + 3, at + 3 + length
        if at > len(frame) or kind != RAW_BLOCK or length > MAX_BLOCK_BYTES:
            return None
        spans.append((start, at))
    whole = at == len(frame) and sum(end - start for start, end in spans) == size
    return spans if whole else None
