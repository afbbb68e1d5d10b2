"""Finds where records begin again after damage: where a length fits the file and the next records follow.

Never inside a torn chunk: zstd stores incompressible data as it is, and messages can be recognised in there, some
with bytes of the compression format in their middle, which no checksum reveals. Records that belong into a chunk are
accepted at the top level only in files without chunks.
"""

from __future__ import annotations

import io
import re
from typing import BinaryIO

from mcap.opcode import Opcode

from recorders.mcap_io.index import MAGIC
from replayers.mcap_io.records import HEAD, MAX_RECORD_BYTES, ChunkRecord, UnreadableRecord, is_known, parse

WINDOW_BYTES = 1 << 20
CHAIN = 3
"""Consecutive records that must fit before an offset after damage is taken for the beginning of one."""


INSIDE = frozenset({int(Opcode.SCHEMA), int(Opcode.CHANNEL), int(Opcode.MESSAGE)})
"""What a chunk holds."""
OF_CHUNKS = frozenset({int(Opcode.CHUNK), int(Opcode.MESSAGE_INDEX)})


def next_record(stream: BinaryIO, start: int, *, chunked: bool | None = None) -> int:
    """The offset at or after start where a record begins again; -1 if there is none.

    Args:
        chunked: whether the file keeps its messages in chunks; None while unknown.
    """
    outside = _next(stream, start, INSIDE)
    if chunked is None:
        stream.seek(max(outside, 0))
        chunked = outside >= 0 and stream.read(1)[0] in OF_CHUNKS
    return outside if chunked else _next(stream, start, frozenset())


def _next(stream: BinaryIO, start: int, excluded: frozenset[int]) -> int:
    size = stream.seek(0, io.SEEK_END)
    at = start
    while at < size:
        stream.seek(at)
        window = stream.read(WINDOW_BYTES + HEAD.size)
        for match in _HEADS.finditer(window):
            if match.start() >= WINDOW_BYTES or window[match.start()] in excluded:
                continue
            if _begins_here(stream, at + match.start(), size):
                return at + match.start()
        at += WINDOW_BYTES
    return -1


def _begins_here(stream: BinaryIO, offset: int, size: int) -> bool:
    """Whether CHAIN records in a row, or records up to the end of the file, begin at an offset."""
    at = offset
    for step in range(CHAIN):
        stream.seek(at)
        head = stream.read(HEAD.size)
        if step and (not head or at + len(head) == size):
            return step > 1 or _is_whole(stream, offset)
        if len(head) < HEAD.size:
            return False
        opcode, length = HEAD.unpack(head)
        if not is_known(opcode):
            return False
        if length > MAX_RECORD_BYTES or at + HEAD.size + length > size:
            return step > 0 and _is_whole(stream, offset)
        at += HEAD.size + length
        if opcode == Opcode.FOOTER:
            return at + len(MAGIC) == size
    return _is_whole(stream, offset)


def _is_whole(stream: BinaryIO, offset: int) -> bool:
    """Whether the record at an offset can be read, a chunk with its checksum."""
    stream.seek(offset)
    opcode, length = HEAD.unpack(stream.read(HEAD.size))
    try:
        record, _ = parse(opcode, stream.read(length))
        if isinstance(record, ChunkRecord):
            record.unpack()
    except UnreadableRecord:
        return False
    return record is not None


_HEADS = re.compile(rb"(?=[\x01-\x0f].{3}[\x00-\x08]\x00\x00\x00\x00)", re.DOTALL)
"""Where a record could begin: a known opcode and a length below 2^35."""
