"""Walks the records of a log and skips damage.

After damage, the walk goes on at the next offset where a record begins: one whose length fits the file and that is
followed by another. No length is trusted before it is compared with what is there.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import BinaryIO, NamedTuple, cast

from mcap.opcode import Opcode

from recorders.mcap_io.index import MAGIC
from replayers.mcap_io.records import (
    HEAD,
    MAX_RECORD_BYTES,
    ChunkRecord,
    RawMessage,
    Record,
    UnreadableRecord,
    opcode_name,
    parse,
)
from replayers.mcap_io.resync import INSIDE, OF_CHUNKS, next_record
from workbench.errors import FileMissing, Malformed, MalformedFile
from workbench.remote.path import RemotePath, path_of

CHUNK_HEAD_BYTES = 48
BOOKKEEPING = frozenset({-1, 2, 7, 8, 10, 11, 13, 14, 15})
"""Opcodes of indexes, statistics and footers, which can be regenerated."""
WITHOUT_CONTENT = BOOKKEEPING | {int(Opcode.HEADER), int(Opcode.SCHEMA), int(Opcode.CHANNEL)}
"""Opcodes of records that say nothing by themselves: nothing is lost where a file ends inside one."""


class NoMcap(MalformedFile):
    """A file that is not MCAP."""

    def __init__(self, path: Path | str, *, empty: bool) -> None:
        what = "it is empty" if empty else "it is no MCAP file"
        super().__init__(path, what, "Give a log that lios recorded, or convert it: lios import")


class DamagedLog(Malformed):
    """A log that cannot be read to its end."""

    def __init__(self, path: Path | str, offset: int, what: str) -> None:
        super().__init__(f"{path}: damaged at byte {offset} ({what}). Save the rest: lios recover {path}")


class Damage(NamedTuple):
    """One place at which a file is not what it should be.

    Attributes:
        offset: byte offset of the record.
        what: description in words.
        cut_off: nothing can be read after it: the file ends early, as when a recorder was killed, perhaps in zeros.
        opcode: opcode of the record, as far as it is known; -1 where there is none.
    """

    offset: int
    what: str
    cut_off: bool = False
    opcode: int = -1

    @property
    def loses_content(self) -> bool:
        """Whether messages, attachments or metadata may have been lost here, and not only bookkeeping."""
        return self.opcode not in (WITHOUT_CONTENT if self.cut_off else BOOKKEEPING)


OnDamage = Callable[[Damage], None]


def open_log(path: Path | str) -> BinaryIO:
    """Opens a log for reading.

    Raises:
        FileMissing, NoMcap, MalformedFile: no such file, not an MCAP file, or it cannot be opened.
        NoCredentials, RangesUnsupported, Unreachable: of one at an address.
    """
    path = path_of(path)
    stream = _remote(path) if isinstance(path, RemotePath) else _local(path)
    magic = stream.read(len(MAGIC))
    if magic != MAGIC:
        stream.close()
        raise NoMcap(path, empty=not magic)
    stream.seek(0)
    return stream


def _remote(path: RemotePath) -> BinaryIO:
    from workbench.remote.reading import open_remote

    return cast("BinaryIO", open_remote(path))


def _local(path: Path) -> BinaryIO:
    try:
        if not S_ISREG(mode := os.stat(path).st_mode) and not S_ISDIR(mode):
            raise MalformedFile(
                path, "it is not a regular file", "Write it to one first: a log is read back and forth"
            )
        return open(path, "rb")
    except (FileNotFoundError, NotADirectoryError):
        raise FileMissing(path) from None
    except IsADirectoryError:
        raise MalformedFile(path, "it is a folder", "Give one log; lios list shows a folder") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise MalformedFile(path, f"it cannot be opened ({reason})", "Check the path and its permissions") from None


def scan(
    stream: BinaryIO,
    *,
    path: Path | str = "",
    on_damage: OnDamage | None = None,
    skip: frozenset[int] = frozenset(),
    jumps: Mapping[int, int] | None = None,
) -> Iterator[tuple[int, Record]]:
    """Every record up to the footer, with its offset; chunks still compressed.

    Args:
        on_damage: called for every damage, after which the walk goes on; without it, damage raises.
        skip: unwanted opcodes; their bytes are not read.
        jumps: offsets of unwanted records, each with the offset at which to go on.

    Raises:
        DamagedLog: damage, when on_damage is not given.
    """
    size = stream.seek(0, io.SEEK_END)
    offset = resume = len(MAGIC)
    chunked: bool | None = None
    while True:
        if jumps is not None and offset in jumps:
            offset = resume = jumps[offset]
            continue
        found = _look(stream, offset, size, skip)
        if chunked and isinstance(found.record, RawMessage):
            found = _is_real_message(found, found.record)
        chunked = _is_chunked(found, chunked)
        if found.damage is None:
            if found.record is not None:
                yield offset, found.record
            if found.opcode == Opcode.FOOTER:
                return
            resume = found.end if found.exact else offset + HEAD.size
            offset = found.end
            continue
        if on_damage is None:
            raise DamagedLog(path, offset, found.damage)
        again = found.end
        if again < 0:
            again = next_record(stream, resume if resume <= offset else offset + 1, chunked=chunked)
        on_damage(Damage(offset, found.damage, again < 0, -1 if found.record is not None else found.opcode))
        if found.record is not None:
            yield offset, found.record
        if again < 0:
            return
        offset, resume = again, max(again, resume + 1)


def _is_real_message(found: _ScanStep, message: RawMessage) -> _ScanStep:
    """A message between chunks, unless it is the index of one whose opcode is damaged: 6 bytes and 16 an entry."""
    entries = 22 + len(message.data) - 6
    if message.sequence != entries or entries % 16:
        return found
    return _ScanStep(int(Opcode.MESSAGE_INDEX), found.end, damage="message index: its opcode is damaged")


def _is_chunked(found: _ScanStep, so_far: bool | None) -> bool | None:
    """Whether messages are in chunks, by what has been seen of the file; an intact chunk outweighs everything."""
    if found.opcode in OF_CHUNKS and (found.damage is None or so_far is None):
        return True
    if found.opcode in INSIDE and found.damage is None and so_far is None:
        return False
    return so_far


class _ScanStep(NamedTuple):
    """What is at an offset: a record, or damage and (end >= 0) where the next record begins."""

    opcode: int
    end: int
    record: Record | None = None
    exact: bool = False
    damage: str | None = None


def _look(stream: BinaryIO, offset: int, size: int, skip: frozenset[int]) -> _ScanStep:
    stream.seek(offset)
    head = stream.read(HEAD.size)
    if len(head) < HEAD.size:
        if not head:
            return _ScanStep(-1, -1, damage="the file ends without a footer")
        return _ScanStep(head[0], -1, damage="the file ends inside a record")
    opcode, length = HEAD.unpack(head)
    end = offset + HEAD.size + length
    if opcode == 0:
        return _ScanStep(0, -1, damage="no record, but zeros")
    if end > size or length > MAX_RECORD_BYTES:
        what = f"it claims {length} bytes, and {size - offset - HEAD.size} are left"
        return _recovered_chunk(
            stream, offset, size, what if end > size else f"it is longer than {MAX_RECORD_BYTES} bytes"
        )
    if opcode in skip:
        return _ScanStep(opcode, end)
    try:
        record, exact = parse(opcode, stream.read(length))
    except UnreadableRecord as error:
        if opcode == Opcode.CHUNK:
            return _recovered_chunk(stream, offset, size, str(error))
        return _ScanStep(opcode, end, damage=f"{opcode_name(opcode)}: {error}")
    if opcode == Opcode.CHUNK and not exact:
        return _recovered_chunk(stream, offset, size, "its lengths disagree")
    return _ScanStep(opcode, end, record, exact)


def _recovered_chunk(stream: BinaryIO, offset: int, size: int, what: str) -> _ScanStep:
    """A chunk whose own length is damaged, by the length of its data or the next record; its checksum decides."""
    stream.seek(offset)
    head = stream.read(HEAD.size + CHUNK_HEAD_BYTES)
    opcode = head[0]
    damage = f"{opcode_name(opcode)}: {what}"
    if opcode != Opcode.CHUNK:
        return _ScanStep(opcode, -1, damage=damage)
    name_length = int.from_bytes(head[HEAD.size + 28 : HEAD.size + 32], "little")
    data = offset + HEAD.size + 40 + name_length
    stream.seek(data - 8)
    length = int.from_bytes(stream.read(8), "little")
    if name_length > 8 or data + length > size or length > MAX_RECORD_BYTES:
        return _ScanStep(opcode, -1, damage=damage)
    stream.seek(offset + HEAD.size)
    try:
        record, _ = parse(opcode, stream.read(40 + name_length + length))
        if isinstance(record, ChunkRecord) and record.uncompressed_crc:
            record.unpack_anyhow()
            return _ScanStep(opcode, data + length, record, exact=True, damage=damage)
    except UnreadableRecord:
        pass
    return _ScanStep(opcode, -1, damage=damage)


def record_at(stream: BinaryIO, offset: int, *, on_damage: OnDamage | None = None) -> Record | None:
    """The record at an offset; None, and damage reported, where there is none or it makes no sense."""
    size = stream.seek(0, io.SEEK_END)
    found = _look(stream, offset, size, frozenset())
    if found.record is None and on_damage is not None:
        on_damage(Damage(offset, found.damage or "no record where the index says", opcode=found.opcode))
    return found.record
