"""The log writer: flushed data are on disk, closed logs are read by mcap's own reader, a full disk leaves a readable
log."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import DataEnd
from mcap.stream_reader import StreamReader

from recorders.mcap_io.writer import LIBRARY, AlreadyClosed, DiskFull, McapWriter
from replayers.mcap_io.reader import messages
from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import read_index
from workbench.errors import CannotCreate, OutputExists, WrongKind


def _fill(writer: McapWriter, count: int, size: int = 100) -> int:
    schema = writer.add_schema("s", "jsonschema", b"{}")
    channel = writer.add_channel("/t", "json", schema, {"k": "v"})
    for i in range(count):
        writer.add_message(channel, bytes([i % 256]) * size, log_time=1000 + i, publish_time=500 + i)
    return channel


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_a_closed_log_is_read_by_mcap_with_all_checksums(tmp_path: Path, compression):
    path = tmp_path / "a.mcap"
    with McapWriter(path, compression=compression, chunk_bytes=1000) as writer:
        _fill(writer, 50)
        writer.add_attachment("a.txt", "text/plain", b"hello", log_time=7, create_time=3)
        writer.add_metadata("m", {"x": "y"})
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        found = list(reader.iter_messages())
        assert [m.log_time for _, _, m in found] == list(range(1000, 1050))
        assert [m.sequence for _, _, m in found] == list(range(50))
        assert found[0][2].publish_time == 500
        assert found[0][1].metadata == {"k": "v"}
        assert reader.get_header().library == LIBRARY
        assert reader.get_header().profile == ""
        assert [a.data for a in reader.iter_attachments()] == [b"hello"]
        assert [m.metadata for m in reader.iter_metadata()] == [{"x": "y"}]
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 50
        assert summary.statistics.message_start_time == 1000
        assert summary.statistics.message_end_time == 1049
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 3
    with open(path, "rb") as stream:
        records = list(StreamReader(stream, validate_crcs=True).records)
        (end,) = [r for r in records if isinstance(r, DataEnd)]
        assert end.data_section_crc != 0


def test_what_was_flushed_is_read_though_the_log_was_never_closed(tmp_path: Path):
    path = tmp_path / "a.mcap"
    writer = McapWriter(path)
    channel = _fill(writer, 10)
    writer.flush()
    writer.add_message(channel, b"not flushed", log_time=99)
    assert writer.bytes_in_hand > 0
    found = list(messages(path))
    assert len(found) == 10
    writer.abandon()
    assert len(list(messages(path))) == 10


def test_a_lost_chunk_costs_only_its_own_messages_because_channels_are_declared_twice(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with McapWriter(path) as writer:
        channel = _fill(writer, 1)
        writer.flush()
        first_chunk_ends = writer.bytes_written
        for i in range(5):
            writer.add_message(channel, b"later", log_time=2000 + i)
        writer.flush()
    data = bytearray(path.read_bytes())
    data[first_chunk_ends - 100] ^= 0xFF
    path.write_bytes(data)
    with open_log(path) as stream:
        index = read_index(stream)
        assert index is not None
    assert [m.data for m in messages(path)] == [b"later"] * 5


def test_writing_does_not_replace_a_log_unless_forced(tmp_path: Path):
    path = tmp_path / "deep" / "er" / "a.mcap"
    McapWriter(path).close()
    before = path.read_bytes()
    with pytest.raises(OutputExists):
        McapWriter(path)
    assert path.read_bytes() == before
    McapWriter(path, force=True).close()


def test_a_folder_or_a_file_in_the_way_is_one_clear_line(tmp_path: Path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(CannotCreate):
        McapWriter(tmp_path / "file" / "a.mcap")
    with pytest.raises(WrongKind, match="it is a folder, and a file is needed"):
        McapWriter(tmp_path, force=True)


def test_a_closed_log_takes_no_more(tmp_path: Path):
    writer = McapWriter(tmp_path / "a.mcap")
    channel = _fill(writer, 1)
    writer.close()
    writer.close()
    with pytest.raises(AlreadyClosed):
        writer.add_message(channel, b"", log_time=0)


def test_appending_rewrites_nothing_but_the_summary(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with McapWriter(path) as writer:
        _fill(writer, 10)
    before = path.read_bytes()
    with open_log(path) as stream:
        index = read_index(stream)
    assert index is not None
    data_end = index.data_end
    with McapWriter.append_to(path, index) as writer:
        channel = writer.add_channel("/more", "json", 0)
        writer.add_message(channel, b"{}", log_time=5000)
    assert path.read_bytes()[:data_end] == before[:data_end]
    with open(path, "rb") as stream:
        assert len(list(make_reader(stream, validate_crcs=True).iter_messages())) == 11
    with open(path, "rb") as stream:
        list(StreamReader(stream, validate_crcs=True).records)


@contextmanager
def _files_no_larger_than(size: int) -> Iterator[None]:
    """Writing beyond a size fails, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)


def test_a_full_disk_leaves_everything_flushed_and_no_torn_record(tmp_path: Path):
    path = tmp_path / "a.mcap"
    with _files_no_larger_than(20_000):
        writer = McapWriter(path, compression="")
        channel = _fill(writer, 0)
        stored: list[int] = []
        with pytest.raises(DiskFull, match="is kept"):
            _store_until_full(writer, channel, stored)
        with pytest.raises(AlreadyClosed):
            writer.flush()
    damage: list[object] = []
    assert len(list(messages(path, on_damage=damage.append))) == len(stored) > 10
    assert len(damage) == 1
    assert damage[0].what == "the file ends without a footer"  # type: ignore[attr-defined]


def _store_until_full(writer: McapWriter, channel: int, stored: list[int]) -> None:
    while True:
        writer.add_message(channel, bytes(997), log_time=len(stored))
        writer.flush()
        stored.append(1)


def test_where_there_is_no_room_at_all_no_file_is_left(tmp_path: Path):
    with _files_no_larger_than(4), pytest.raises(CannotCreate):
        McapWriter(tmp_path / "a.mcap")
    assert not list(tmp_path.iterdir())


def test_with_little_room_left_the_log_is_closed_properly(tmp_path: Path):
    path = tmp_path / "a.mcap"
    writer = McapWriter(path)
    channel = _fill(writer, 10)
    writer.flush()
    writer.add_message(channel, b"too late", log_time=9999)
    writer._keep_free_bytes = 1 << 62
    with pytest.raises(DiskFull, match="MiB of the disk are free"):
        writer.flush()
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 10
        assert summary.statistics.message_end_time == 1009
        assert len(list(reader.iter_messages())) == 10


def test_a_process_that_is_killed_loses_nothing_that_it_flushed(tmp_path: Path):
    path = tmp_path / "a.mcap"
    code = (
        "import os, sys\n"
        "from recorders.mcap_io.writer import McapWriter\n"
        "w = McapWriter(sys.argv[1]); c = w.add_channel('/t', 'json', 0)\n"
        "for i in range(100):\n"
        "    w.add_message(c, b'x', log_time=i)\n"
        "    if i == 49: w.flush()\n"
        "os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], check=False)
    assert done.returncode == -9
    assert [m.log_time for m in messages(path)] == list(range(50))
