"""Closed logs with one damaged chunk behind an intact index."""

from __future__ import annotations

from pathlib import Path

from mcap.records import ChunkIndex

from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import read_index


def chunks_of(path: Path) -> list[ChunkIndex]:
    """The chunks of a closed log."""
    with open_log(path) as stream:
        index = read_index(stream)
    assert index is not None
    return index.chunks


def flip(path: Path, output: Path, number: int) -> Path:
    """Writes a copy with one flipped byte in the middle of a chunk's data."""
    chunks = chunks_of(path)
    chunk = chunks[number % len(chunks)]
    data = bytearray(path.read_bytes())
    data[chunk.chunk_start_offset + chunk.chunk_length // 2 + 20] ^= 0xFF
    output.write_bytes(data)
    return output
