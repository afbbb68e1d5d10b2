"""Damage behind an intact index, found by the checksums of a log."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import DataEnd

from recorders.mcap_io.index import LogIndex
from replayers.mcap_io.records import ChunkRecord, UnreadableRecord
from replayers.mcap_io.scan import Damage, open_log, scan

STEP_BYTES = 1 << 20
MESSAGE_INDEXES = frozenset({int(Opcode.MESSAGE_INDEX)})


def damages_behind(path: Path | str, index: LogIndex) -> list[Damage]:
    """The places of an indexed log whose messages, attachments or metadata cannot be read.

    The checksum of the whole data is compared where the log has one; only where it has none, or it is wrong, are the
    chunks unpacked.
    """
    found: list[Damage] = []
    with open_log(path) as stream:
        if index.data_crc and index.data_crc == _data_crc(stream, index.data_end):
            return []
        for offset, record in scan(stream, path=path, on_damage=found.append, skip=MESSAGE_INDEXES):
            if isinstance(record, DataEnd):
                break
            if isinstance(record, ChunkRecord):
                try:
                    record.unpack_anyhow()
                except UnreadableRecord as error:
                    found.append(Damage(offset, f"chunk: {error}", opcode=Opcode.CHUNK))
    return [damage for damage in found if damage.loses_content]


def _data_crc(stream: BinaryIO, end: int) -> int:
    """The checksum of a file's bytes up to an offset."""
    stream.seek(0)
    crc, left = 0, end
    while left > 0 and (block := stream.read(min(STEP_BYTES, left))):
        crc = zlib.crc32(block, crc)
        left -= len(block)
    return crc
