"""Unpacks the files of a bag that were compressed as a whole (rosbag2's compression mode FILE).

Rosbag2 writes one zstd frame a file; other tools write several, which count as one file.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import zstandard

from workbench.errors import Malformed

PIECE_BYTES = 1 << 12
"""Compressed bytes that are unpacked at a time; they become 128 MB at most, since four bytes can stand for 128 kB."""
FRAME_HEADER_BYTES = 18
KEEP_FREE_BYTES = 1_000_000_000
"""What unpacking leaves free on the disk of temporary files."""


class Packed(Malformed):
    """A compressed file of a bag without its folder's metadata.yaml."""

    def __init__(self, path: Path) -> None:
        plain = path.with_suffix("")
        super().__init__(
            f"{path}: compressed as a whole, and without its folder's metadata.yaml it cannot be read as it is. "
            f"Run zstd -d {path} (if it was cut off, then lios recover {plain}), then import {plain}."
        )


class CutOffPacked(Malformed):
    """A compressed file that ends inside its compressed data."""

    def __init__(self, path: Path) -> None:
        plain = path.with_suffix("").name
        super().__init__(
            f"{path}: cut off inside its compressed data. Run zstd -dc {path} > {plain}, which writes what is left "
            f"(if it is MCAP, then lios recover {plain}), and import that file."
        )


class NoSpaceToUnpack(Malformed):
    """A compressed file that takes more room than the disk of temporary files has."""

    def __init__(self, path: Path, takes: int, folder: Path, free: int) -> None:
        super().__init__(
            f"{path}: unpacked it takes {takes / 1e9:,.1f} GB or more, and {folder} has {free / 1e9:,.1f} GB free, "
            f"of which {KEEP_FREE_BYTES / 1e9:.0f} GB stay free. Set TMPDIR to a folder with room, or run "
            f"zstd -d {path} where there is room and import the result."
        )


def unpack_file(packed: Path, plain: Path) -> None:
    """Writes a compressed file's content to another file, as long as the disk has room.

    Raises:
        CutOffPacked: it ends too early. NoSpaceToUnpack: it takes too much room; nothing is left of it.
        zstandard.ZstdError: it is not what zstd writes.
    """
    room = shutil.disk_usage(plain.parent).free - KEEP_FREE_BYTES
    takes = _declared_bytes(packed)
    try:
        with plain.open("wb") as out:
            for piece in _unpacked(packed) if takes <= room else ():
                takes = max(takes, out.tell() + len(piece))
                if takes > room:
                    break
                out.write(piece)
    except CutOffPacked:
        plain.unlink()
        raise
    if takes > room:
        plain.unlink()
        raise NoSpaceToUnpack(packed, takes, plain.parent.parent, max(0, room) + KEEP_FREE_BYTES)


def _declared_bytes(packed: Path) -> int:
    """What the first frame says that it holds; 0 where it does not say."""
    with packed.open("rb") as stream:
        size = zstandard.get_frame_parameters(stream.read(FRAME_HEADER_BYTES)).content_size
    return 0 if size == zstandard.CONTENTSIZE_UNKNOWN else size


def _unpacked(packed: Path) -> Iterator[bytes]:
    """The content in pieces."""
    with packed.open("rb") as stream:
        frame = zstandard.ZstdDecompressor().decompressobj()
        begun = False
        while data := stream.read(PIECE_BYTES):
            while data:
                yield frame.decompress(data)
                begun, data = not frame.eof, frame.unused_data if frame.eof else b""
                if frame.eof:
                    frame = zstandard.ZstdDecompressor().decompressobj()
        if begun:
            raise CutOffPacked(packed)
