"""A log as it is on disk while it is being recorded: its beginnings, each with a whole record more."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from replayers.mcap_io.records import ChunkRecord
from replayers.mcap_io.scan import open_log, scan


def grown(log: Path, copy: Path) -> Iterator[Path]:
    """A copy that grows chunk by chunk until it is the whole log."""
    data = log.read_bytes()
    with open_log(log) as stream:
        chunks = [offset for offset, record in scan(stream, path=log) if isinstance(record, ChunkRecord)]
    for end in (*chunks, len(data)):
        copy.write_bytes(data[:end])
        yield copy
