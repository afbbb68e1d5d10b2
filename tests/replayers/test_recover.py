"""Logs cut anywhere and flipped anywhere: never a traceback, everything intact is saved, and the doctor notices."""

from __future__ import annotations

import io
import os
import random
import re
import resource
import tracemalloc
from pathlib import Path

import pytest
from sample_logs import killed_toy_log, toy_events, write_toy_log

from recorders.mcap_io.writer import McapWriter
from replayers.commands.doctor import worst
from replayers.doctor.examine import examine
from replayers.doctor.findings import Level, Verdict
from replayers.log_tools.info import describe
from replayers.log_tools.recover import recover
from replayers.mcap_io.reader import messages
from replayers.mcap_io.scan import NoMcap, open_log
from replayers.mcap_io.summary import read_index
from replayers.runs.run import read
from workbench.errors import BadValue, LiosError, OutputExists

SPREAD = pytest.mark.parametrize("apart", [7, pytest.param(1, marks=pytest.mark.slow)])
"""Every seventh byte, which meets all bits in turn; every byte with the slow tests."""


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A log of 1.5 kB with two chunks, an attachment and metadata."""
    path = tmp_path_factory.mktemp("small") / "a.mcap"
    with McapWriter(path) as writer:
        channel = writer.add_channel("/t", "json", writer.add_schema("s", "jsonschema", b"{}"))
        writer.add_metadata("m", {"a": "b"})
        writer.add_attachment("x.txt", "text/plain", b"hello", log_time=1)
        for i in range(6):
            writer.add_message(channel, b"%03d" % i, log_time=i)
            if i == 2:
                writer.flush()
    return path.read_bytes()


@pytest.fixture(scope="module")
def run_log(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write_toy_log(tmp_path_factory.mktemp("run") / "a.mcap").read_bytes()


def _tried(path: Path) -> None:
    """Everything that a person may do with a log, each ending in an answer or in one line."""
    for action in (examine, describe, read, lambda p: list(messages(p))):
        try:
            action(path)
        except LiosError as error:
            if "\n" in str(error):
                pytest.fail(f"an error of several lines: {error}")


def _saved(data: bytes, folder: Path) -> list[tuple[str, int, bytes]] | None:
    """The messages that recovery saves; None for what is no MCAP file. The result must be clean."""
    broken, clean = folder / "broken.mcap", folder / "clean.mcap"
    broken.write_bytes(data)
    _tried(broken)
    try:
        recover(broken, clean, force=True)
    except NoMcap:
        return None
    examined = examine(clean)
    others = [f for f in examined.findings if not f.what.startswith("recovered from")]
    assert not {f.level for f in others} & {Level.ERROR, Level.LOSS}, examined.findings
    return [(m.topic, m.log_time, m.data) for m in messages(clean)]


def _flushed_before(data: bytes, cut: int, folder: Path) -> list[tuple[str, int, bytes]]:
    """The messages of all chunks that are whole in the first `cut` bytes."""
    path = folder / "whole.mcap"
    path.write_bytes(data)
    with open_log(path) as stream:
        index = read_index(stream)
    assert index is not None
    ends = [chunk.chunk_start_offset + chunk.chunk_length for chunk in index.chunks]
    whole = sum(end <= cut for end in ends)
    counts = [0]
    for chunk in index.chunks:
        sizes = [len(m) for m in [list(_of_chunk(path, chunk.chunk_start_offset))]]
        counts.append(counts[-1] + sizes[0])
    return [(m.topic, m.log_time, m.data) for m in messages(path)][: counts[whole]]


def _of_chunk(path: Path, offset: int) -> list[object]:
    from replayers.mcap_io.records import ChunkRecord, RawMessage, records_in
    from replayers.mcap_io.scan import record_at

    with open_log(path) as stream:
        record = record_at(stream, offset)
        assert isinstance(record, ChunkRecord)
        return [inner for _, inner in records_in(record.unpack()) if isinstance(inner, RawMessage)]


@SPREAD
def test_a_small_log_cut_anywhere_gives_all_that_was_flushed(apart: int, small: bytes, tmp_path: Path):
    for cut in range(0, len(small), apart):
        saved = _saved(small[:cut], tmp_path)
        assert saved == (None if cut < 8 else _flushed_before(small, cut, tmp_path)), cut


@pytest.mark.ci
def test_a_run_cut_here_and_there_gives_all_that_was_flushed(run_log: bytes, tmp_path: Path):
    for cut in range(8, len(run_log), 997):
        assert _saved(run_log[:cut], tmp_path) == _flushed_before(run_log, cut, tmp_path), cut


@pytest.mark.slow
@pytest.mark.timeout(6000)
def test_a_run_cut_at_every_byte_takes_no_more_than_200_mb(run_log: bytes, tmp_path: Path):
    """A quarter of an hour; LIOS_CUT_STEP makes it shorter. The process itself is measured: what it takes more."""
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    cuts = range(0, len(run_log), int(os.environ.get("LIOS_CUT_STEP", "1")))
    for cut in cuts:
        saved = _saved(run_log[:cut], tmp_path)
        assert (saved is None) == (cut < 8), cut
    took_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib) / 1024
    print(f"{len(cuts)} cuts, {took_mb:.0f} MB")
    assert took_mb < 200


@SPREAD
def test_a_flipped_byte_anywhere_in_a_small_log_is_noticed_and_costs_one_chunk_at_most(
    apart: int, small: bytes, tmp_path: Path
):
    whole = _saved(small, tmp_path)
    assert whole is not None
    for at in range(0, len(small), apart):
        data = bytearray(small)
        data[at] ^= 1 << (at % 8)
        saved = _saved(bytes(data), tmp_path)
        if at < 8:
            assert saved is None
            continue
        assert examine(tmp_path / "broken.mcap").verdict is not Verdict.FINE, at
        assert saved is not None
        assert len(saved) >= 3, at
        assert set(saved) <= set(whole), at


@pytest.mark.ci
def test_a_flipped_byte_in_a_run_is_noticed_and_costs_one_chunk_at_most(run_log: bytes, tmp_path: Path):
    whole = _saved(run_log, tmp_path)
    assert whole is not None
    largest = max(_chunk_sizes(run_log, tmp_path))
    rng = random.Random(1)
    for at in sorted(rng.sample(range(8, len(run_log)), 60)):
        data = bytearray(run_log)
        data[at] ^= 1 << rng.randrange(8)
        saved = _saved(bytes(data), tmp_path)
        assert examine(tmp_path / "broken.mcap").verdict is not Verdict.FINE, at
        assert saved is not None
        assert len(saved) >= len(whole) - largest, at
        assert set(saved) <= set(whole), at


def _chunk_sizes(data: bytes, folder: Path) -> list[int]:
    path = folder / "whole.mcap"
    path.write_bytes(data)
    with open_log(path) as stream:
        index = read_index(stream)
    assert index is not None
    return [len(_of_chunk(path, chunk.chunk_start_offset)) for chunk in index.chunks]


def test_an_index_whose_opcode_is_damaged_is_no_message(small: bytes, tmp_path: Path):
    whole = _saved(small, tmp_path)
    for match in re.finditer(rb"\x07(\x16|\x36)\x00{7}", small):
        data = bytearray(small)
        data[match.start()] = 5
        assert _saved(bytes(data), tmp_path) == whole
        assert examine(tmp_path / "broken.mcap").verdict is Verdict.FAULTY


@pytest.mark.parametrize("flushed", [0, 1])
def test_nothing_is_picked_out_of_a_torn_chunk(flushed: int, tmp_path: Path):
    """zstd stores pictures as they are, with its own bytes between: messages in there look whole and are not."""
    rng = random.Random(1)
    path = tmp_path / "a.mcap"
    with McapWriter(path) as writer:
        channel = writer.add_channel("/camera", "x", 0)
        for i in range(flushed):
            writer.add_message(channel, b"flushed", log_time=i)
            writer.flush()
        for i in range(300):
            writer.add_message(channel, rng.randbytes(3000), log_time=flushed + i)
    torn = path.read_bytes()[:500_000]
    assert _saved(torn, tmp_path) == [("/camera", i, b"flushed") for i in range(flushed)]


def test_damage_in_a_file_without_chunks_costs_one_message(tmp_path: Path):
    from mcap.writer import Writer

    path = tmp_path / "a.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream, use_chunking=False)
        writer.start()
        channel = writer.register_channel("/t", "x", writer.register_schema("s", "t", b"structure"))
        for i in range(10):
            writer.add_message(channel, i, b"message %d" % i, i)
        writer.finish()
    data = path.read_bytes()
    for damaged in (data.index(b"structure") - 30, data.index(b"message 0") - 25, data.index(b"message 4") - 25):
        broken = bytearray(data)
        broken[damaged] ^= 0x80
        (tmp_path / "b.mcap").write_bytes(broken)
        done = recover(tmp_path / "b.mcap", tmp_path / "c.mcap", force=True)
        assert done.messages >= 9, damaged


def test_zeros_at_the_end_as_after_a_power_cut_do_no_harm(run_log: bytes, tmp_path: Path):
    killed = killed_toy_log(tmp_path / "k.mcap").read_bytes()
    want = _saved(killed, tmp_path)
    assert want
    assert _saved(killed + bytes(100_000), tmp_path) == want


def test_rubbish_in_the_middle_is_stepped_over(run_log: bytes, tmp_path: Path):
    whole = _saved(run_log, tmp_path)
    path = tmp_path / "whole.mcap"
    path.write_bytes(run_log)
    with open_log(path) as stream:
        index = read_index(stream)
    assert index is not None
    between = index.chunks[2].chunk_start_offset
    rubbish = random.Random(2).randbytes(5000)
    assert _saved(run_log[:between] + rubbish + run_log[between:], tmp_path) == whole


def test_a_killed_recording_is_recovered_without_loss(tmp_path: Path):
    path = killed_toy_log(tmp_path / "k.mcap")
    examined = examine(path)
    assert examined.verdict is Verdict.LOSSY
    done = recover(path, tmp_path / "r.mcap")
    assert not done.lossy
    assert not done.was_closed
    assert done.messages == examined.messages > 0
    run = read(tmp_path / "r.mcap")
    assert run.outcome is None
    assert run.observations == read(path).observations


def test_identity_is_saved_even_where_its_metadata_is_damaged(run_log: bytes, tmp_path: Path):
    at = run_log.index(b"model-lios")
    data = bytearray(run_log)
    data[at] ^= 1
    saved = _saved(bytes(data), tmp_path)
    assert saved
    assert read(tmp_path / "clean.mcap").info.strategy == "model-lios"


def test_lengths_that_lie_allocate_nothing(small: bytes, tmp_path: Path):
    import struct

    path = tmp_path / "a.mcap"
    huge = struct.pack("<BQ", 6, 1 << 62), struct.pack("<BQ", 5, (1 << 32) - 1), struct.pack("<BQ", 9, 1 << 40)
    chunk = struct.pack("<BQQQQLLQ", 6, 40, 0, 0, 1 << 60, 1, 0, 0)
    bomb = _zstd_bomb()
    tracemalloc.start()
    for tail in (*huge, chunk, bomb):
        path.write_bytes(small[:60] + tail + small[60:])
        _tried(path)
        recover(path, tmp_path / "b.mcap", force=True)
    assert tracemalloc.get_traced_memory()[1] < 200e6
    tracemalloc.stop()


def _zstd_bomb() -> bytes:
    """A chunk of a few kB that unpacks to a gigabyte, and says so."""
    import struct

    import zstandard

    machine = zstandard.ZstdCompressor().compressobj()
    packed = b"".join(machine.compress(bytes(1 << 24)) for _ in range(64)) + machine.flush()
    head = struct.pack("<QQQLL4sQ", 0, 0, 1 << 30, 1, 4, b"zstd", len(packed))
    return struct.pack("<BQ", 6, len(head) + len(packed)) + head + packed


@pytest.mark.parametrize("content", [b"", b"\x89MCAP", b"SQLite format 3\x00", b"#ROSBAG V2.0\n", bytes(1000)])
def test_what_is_no_log_is_one_line(content: bytes, tmp_path: Path):
    path = tmp_path / "a.mcap"
    path.write_bytes(content)
    for action in (read, examine, describe, lambda p: recover(p, tmp_path / "b.mcap")):
        with pytest.raises(NoMcap, match=r"no MCAP|empty"):
            action(path)
    assert not (tmp_path / "b.mcap").exists()


def test_recovery_overwrites_neither_its_source_nor_anything_else(tmp_path: Path):
    path = write_toy_log(tmp_path / "a.mcap")
    (tmp_path / "b.mcap").write_text("mine")
    with pytest.raises(BadValue):
        recover(path, path, force=True)
    with pytest.raises(OutputExists):
        recover(path, tmp_path / "b.mcap")
    assert (tmp_path / "b.mcap").read_text() == "mine"
    assert read(path).complete


def test_a_log_of_any_other_writer_is_recovered_too(tmp_path: Path):
    from mcap.writer import CompressionType, Writer

    for compression in CompressionType:
        for chunked in (True, False):
            path = tmp_path / "a.mcap"
            with open(path, "wb") as stream:
                writer = Writer(stream, compression=compression, use_chunking=chunked)
                writer.start(profile="ros2", library="other")
                channel = writer.register_channel("/t", "cdr", writer.register_schema("s", "ros2msg", b"x"))
                for i in range(10):
                    writer.add_message(channel, i, bytes([i]) * 50, i)
                writer.finish()
            assert [m.data for m in messages(path)] == [bytes([i]) * 50 for i in range(10)]
            assert examine(path).verdict is Verdict.FINE
            done = recover(path, tmp_path / "b.mcap", force=True)
            assert (done.messages, done.lossy) == (10, False)


def test_the_worst_of_several_logs_decides():
    assert [worst(codes) for codes in ([0, 0], [0, 3], [3, 1, 0], [])] == [0, 3, 1, 0]


def test_the_toy_run_is_fine(run_log: bytes, tmp_path: Path):
    (tmp_path / "a.mcap").write_bytes(run_log)
    examined = examine(tmp_path / "a.mcap")
    assert [f for f in examined.findings if f.level != "info"] == []
    assert examined.loss_window_s == 1.0
    assert len(toy_events()) > 10


def test_small_records_are_read_as_mcap_reads_them_and_refused_when_cut():
    """Those that we parse ourselves, for speed: chunk indexes; and those that are read once: schemas and channels."""
    from mcap.data_stream import ReadDataStream
    from mcap.opcode import Opcode
    from mcap.records import Channel, ChunkIndex, Schema

    from recorders.mcap_io.index import record_bytes
    from replayers.mcap_io.records import HEAD, UnreadableRecord, parse

    for record, opcode in (
        (ChunkIndex(7, 8, "zstd", 9, 10, 11, {3: 12, 4: 2**63}, 13, 14), Opcode.CHUNK_INDEX),
        (ChunkIndex(0, 0, "", 0, 0, 0, {}, 0, 0), Opcode.CHUNK_INDEX),
        (Schema(id=1, data=b"{}", encoding="jsonschema", name="x"), Opcode.SCHEMA),
        (Channel(id=1, topic="/x", message_encoding="json", metadata={"a": "b"}, schema_id=1), Opcode.CHANNEL),
    ):
        body = record_bytes(record)[HEAD.size :]
        assert parse(opcode, body) == (record, True)
        assert type(record).read(ReadDataStream(io.BytesIO(body))) == record
        assert parse(opcode, body + b"more") == (record, False)
        for cut in range(len(body)):
            with pytest.raises(UnreadableRecord):
                parse(opcode, body[:cut])


def test_a_channel_that_is_declared_anew_is_looked_at_again():
    from mcap.records import Channel

    from replayers.mcap_io.messages import ChunkMessages
    from replayers.mcap_io.records import RawMessage

    def channel(topic: str) -> Channel:
        return Channel(id=1, topic=topic, message_encoding="json", metadata={}, schema_id=0)

    content = ChunkMessages(topics="/wanted".__eq__)
    seen = []
    for record in (
        channel("/not"),
        RawMessage(1, 0, 0, 0, b"1"),
        channel("/wanted"),
        RawMessage(1, 0, 0, 0, b"2"),
        channel("/not"),
    ):
        seen += [message.data for message in content.messages_of(0, record)]
    assert seen + [m.data for m in content.messages_of(0, RawMessage(1, 0, 0, 0, b"3"))] == [b"2"]
