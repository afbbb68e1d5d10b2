"""Intact chunks are copied byte for byte, and the tools that copy logs keep at least what recover keeps."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer
from mcap_layouts import Contents, Layout, file_of
from test_all_layouts import _small as small_contents

from replayers.doctor.examine import examine
from replayers.doctor.findings import Verdict
from replayers.log_tools.copy_log import LogLayout
from replayers.log_tools.recover import recover
from replayers.log_tools.rewrite import MessageFilter, filtered, merge_logs, patterns
from replayers.mcap_io.reader import messages, metadata
from replayers.mcap_io.records import ChunkRecord
from replayers.mcap_io.scan import open_log, scan
from workbench import cli

LOGS = Path(__file__).parents[2] / "logs"
SECOND = 10**9
LAYOUTS = {
    "full": Layout(),
    "bare": Layout(message_index=False, statistics=False),
    "loose": Layout(chunked=False, message_index=False, chunk_index=False),
}


def _write(path: Path, topics: list[str], *, start_s: int = 0, count: int = 60, seed: int = 1) -> Path:
    """Pictures of 3 kB, one a second, in chunks of 10 kB."""
    rng = random.Random(seed)
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=10_000, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("Picture", "ros2msg", b"uint8[] data")
        channels = [writer.register_channel(topic, "cdr", schema) for topic in topics]
        for number in range(count):
            stamp = (start_s + number) * SECOND
            writer.add_message(channels[number % len(channels)], stamp, rng.randbytes(3000), stamp, number)
        writer.finish()
    return path


def _chunks(path: Path) -> list[bytes]:
    with open_log(path) as stream:
        return [bytes(record.packed) for _, record in scan(stream) if isinstance(record, ChunkRecord)]


def _held(path: Path) -> list[tuple[str, int, int, bytes]]:
    return [(m.topic, m.log_time, m.sequence, m.data) for m in messages(path, on_damage=lambda damage: None)]


COPIES: dict[str, Callable[[Path, Path], object]] = {
    "recover": recover,
    "filter": lambda source, output: filtered(source, output, MessageFilter(), LogLayout()),
    "merge": lambda source, output: merge_logs([source], output, LogLayout()),
}


@pytest.mark.parametrize("copy", COPIES)
def test_intact_chunks_are_copied_byte_for_byte(copy: str, tmp_path: Path):
    source = _write(tmp_path / "a.mcap", ["/left", "/right"])
    COPIES[copy](source, tmp_path / "b.mcap")
    assert _chunks(tmp_path / "b.mcap") == _chunks(source)
    assert _held(tmp_path / "b.mcap") == _held(source)
    assert examine(tmp_path / "b.mcap").verdict is Verdict.FINE


def test_a_filter_copies_the_chunks_within_the_time_and_does_not_read_the_others(tmp_path: Path):
    source = _write(tmp_path / "a.mcap", ["/left"])
    expected = [m for m in _held(source) if 20 * SECOND <= m[1] < 40 * SECOND]
    data = bytearray(source.read_bytes())
    data[200] ^= 1  # in the first chunk, which is not wanted
    source.write_bytes(data)
    done = filtered(source, tmp_path / "b.mcap", MessageFilter(start_ns=20 * SECOND, end_ns=40 * SECOND), LogLayout())
    assert _held(tmp_path / "b.mcap") == expected
    assert (done.messages, done.dropped, done.loss.count) == (20, 40, 0)
    assert len(set(_chunks(source)) & set(_chunks(tmp_path / "b.mcap"))) >= 4


def test_a_filter_leaves_no_trace_of_a_topic_that_is_not_wanted(tmp_path: Path):
    source = _write(tmp_path / "a.mcap", ["/left", "/right"])
    wanted = MessageFilter(exclude=patterns(["/left"], "-n"))
    done = filtered(source, tmp_path / "b.mcap", wanted, LogLayout())
    assert (done.messages, done.dropped) == (30, 30)
    assert b"/left" not in (tmp_path / "b.mcap").read_bytes()
    assert _held(tmp_path / "b.mcap") == [m for m in _held(source) if m[0] == "/right"]


def test_logs_that_follow_each_other_merge_by_whole_chunks_and_those_that_overlap_by_messages(tmp_path: Path):
    first, second = (
        _write(tmp_path / f"{name}.mcap", [f"/{name}"], start_s=start, count=count, seed=start)
        for name, start, count in (("long", 0, 60), ("short", 50, 20))
    )
    output = tmp_path / "c.mcap"
    merge_logs([second, first], output, LogLayout())
    held = _held(output)
    assert sorted(held) == sorted(_held(first) + _held(second))
    assert all(before[1] <= after[1] for before, after in pairwise(held))
    kept = set(_chunks(output)) & set(_chunks(first))
    assert len(kept) >= len(_chunks(first)) // 2, "the larger log's chunks stay although both number channels from 1"
    assert examine(output).verdict is Verdict.FINE


def test_explicit_chunk_sizes_and_compressions_are_made(tmp_path: Path):
    source = _write(tmp_path / "a.mcap", ["/left"])
    for number, options in enumerate((["--chunk-size", "100000"], ["--compression", "none"])):
        output = tmp_path / f"{number}.mcap"
        assert cli.run(["log", "filter", str(source), "-o", str(output), *options]) == 0
        assert not set(_chunks(source)) & set(_chunks(output))
        assert _held(output) == _held(source)


DAMAGES: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "a flipped byte": lambda data, rng: _flipped(data, rng.randrange(60, len(data))),
    "five flipped bytes": lambda data, rng: _flipped(data, *rng.sample(range(60, len(data)), 5)),
    "a torn tail": lambda data, rng: data[: rng.randrange(len(data) // 4, len(data))],
    "no summary": lambda data, rng: data[: data.rindex(b"\x0f\x04\x00\x00\x00\x00\x00\x00\x00")],
    "no summary and a flipped byte": lambda data, rng: _flipped(
        data[: len(data) * 3 // 4], rng.randrange(60, len(data) * 3 // 4)
    ),
}


def _flipped(data: bytes, *places: int) -> bytes:
    changed = bytearray(data)
    for place in places:
        changed[place] ^= 1 << place % 8
    return bytes(changed)


@pytest.mark.ci_but(4)
@pytest.mark.parametrize("kind", DAMAGES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_filter_compact_and_convert_keep_what_recover_keeps(kind: str, layout: str, tmp_path: Path):
    base = small_contents()
    contents = Contents(base.schemas, base.channels, base.messages * 6, base.others)
    whole, rng = file_of(contents, LAYOUTS[layout]), random.Random(7)
    for number in range(6):
        source = tmp_path / f"{number}.mcap"
        source.write_bytes(DAMAGES[kind](whole, rng))
        recover(source, tmp_path / f"{number}-recovered.mcap")
        saved = sorted(_held(tmp_path / f"{number}-recovered.mcap"))
        for command in ("filter", "compact", "convert"):
            output = tmp_path / f"{number}-{command}.mcap"
            assert cli.run(["log", command, str(source), "-o", str(output)]) in (0, 3)
            assert sorted(_held(output)) == saved, (command, number)


def test_a_copied_chunk_has_a_checksum_even_where_its_source_has_none(tmp_path: Path):
    """Found by fuzzing: what was recovered from a chunk whose checksum had become 0 had none either."""
    log, copy = tmp_path / "a.mcap", tmp_path / "b.mcap"
    with log.open("wb") as stream:
        writer = Writer(stream, enable_crcs=False)
        writer.start()
        writer.add_message(writer.register_channel("/t", "cdr", 0), 1, b"x" * 100, 1)
        writer.finish()
    recover(log, copy)
    with open_log(copy) as stream:
        (chunk,) = [record for _, record in scan(stream) if isinstance(record, ChunkRecord)]
    assert chunk.uncompressed_crc == zlib.crc32(chunk.unpack())
    assert [finding.what for finding in examine(copy).findings if "checksum" in finding.what] == []


@pytest.mark.parametrize("tool", ["recover", "filter", "compact", "convert", "merge", "split"])
def test_metadata_with_a_wrong_checksum_is_told_and_not_copied(
    tool: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """The identity of the run is taken from settings.json, which repeats it."""
    log, copy = tmp_path / "damaged.mcap", tmp_path / "copy.mcap"
    data = bytearray((LOGS / "find-lios.mcap").read_bytes())
    data[data.index(b"model-lios")] ^= 1
    log.write_bytes(data)
    more = {"recover": ["recover"], "split": ["log", "split", "--size", "1000000"]}.get(tool, ["log", tool])
    assert cli.run([*more, str(log), "-o", str(copy)]) == 3
    assert "the checksum of 'lios.run' is wrong" in capsys.readouterr().err
    copy = tmp_path / "copy_0000.mcap" if tool == "split" else copy
    told = metadata(copy, "lios.run")
    assert told is not None
    assert told["strategy"] == "model-lios"
    assert examine(log).verdict is Verdict.FAULTY
    for words in (["list", str(log)], ["info", str(log)], ["doctor", str(log)]):
        assert cli.run(words) in ((1,) if words[0] == "doctor" else (3,)), words


def test_what_other_writers_call_a_checksum_in_their_metadata_is_left_alone(tmp_path: Path):
    log = tmp_path / "a.mcap"
    with log.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.add_metadata("calibration", {"crc32": "of something else"})
        writer.finish()
    assert recover(log, tmp_path / "b.mcap").metadata == 1
    assert metadata(tmp_path / "b.mcap", "calibration") == {"crc32": "of something else"}
