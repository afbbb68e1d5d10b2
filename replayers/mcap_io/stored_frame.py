"""zstd frames that store their content as it is, as encoders do with pictures: one pass gives both checksums.

Format: RFC 8878, sections 3.1.1.1 and 3.1.1.2.
"""

from __future__ import annotations

import zlib
from typing import NamedTuple

from recorders.mcap_io.crc32 import combined_crc

MAGIC = b"\x28\xb5\x2f\xfd"
SINGLE_SEGMENT = 0b0010_0000
SIZE_BYTES = (1, 2, 4, 8)
"""Length of the content's size, by the two highest bits of the frame's descriptor; 256 is added to one of 2 bytes."""
MAX_BLOCK_BYTES = 128 << 10
RAW_BLOCK = 0


class StoredFrame(NamedTuple):
    """The content of a frame that stores it as it is.

    Attributes:
        crc: checksum of the content.
        frame_crc: checksum of the frame itself.
    """

    content: bytes
    crc: int
    frame_crc: int


def stored_frame(frame: bytes | memoryview) -> StoredFrame | None:
    """Reads a single frame whose blocks are all stored, without dictionary and checksum; None for any other."""
    frame = memoryview(frame)
    spans = _stored_blocks(frame)
    if spans is None:
        return None
    crc = frame_crc = at = 0
    for start, end in spans:
        block = zlib.crc32(frame[start:end])
        crc = combined_crc(crc, block, end - start)
        frame_crc = combined_crc(zlib.crc32(frame[at:start], frame_crc), block, end - start)
        at = end
    return StoredFrame(b"".join([frame[start:end] for start, end in spans]), crc, frame_crc)


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
