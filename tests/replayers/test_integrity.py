"""Damage behind an intact index is found with a checksum over the data and without one."""

from __future__ import annotations

from pathlib import Path

import pytest
from damaged_logs import chunks_of, flip
from sample_logs import write_toy_log

from recorders.mcap_io.index import LogIndex
from replayers.mcap_io.integrity import damages_behind
from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import read_index


def _index(path: Path) -> LogIndex:
    with open_log(path) as stream:
        index = read_index(stream)
    assert index is not None
    return index


def _without_data_crc(path: Path) -> Path:
    """The same log, whose writer computed no checksum of its data."""
    index = _index(path)
    data = bytearray(path.read_bytes())
    data[index.data_end + 9 : index.data_end + 13] = bytes(4)
    output = path.with_name(f"plain-{path.name}")
    output.write_bytes(data)
    return output


@pytest.mark.parametrize("checksum", [True, False])
def test_every_damaged_chunk_is_found_where_it_begins(tmp_path: Path, checksum: bool):
    log = write_toy_log(tmp_path / "a.mcap")
    log = log if checksum else _without_data_crc(log)
    assert bool(_index(log).data_crc) is checksum
    assert damages_behind(log, _index(log)) == []
    for number, chunk in enumerate(chunks_of(log)):
        damaged = flip(log, tmp_path / "b.mcap", number)
        assert [d.offset for d in damages_behind(damaged, _index(damaged))] == [chunk.chunk_start_offset]


def test_a_wrong_checksum_over_sound_chunks_is_no_loss(tmp_path: Path):
    """A message index that lies: bookkeeping, which can be made again."""
    log = write_toy_log(tmp_path / "a.mcap")
    chunk = chunks_of(log)[0]
    data = bytearray(log.read_bytes())
    data[chunk.chunk_start_offset + chunk.chunk_length + 20] ^= 0xFF
    log.write_bytes(data)
    assert damages_behind(log, _index(log)) == []
