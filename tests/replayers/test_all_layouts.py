"""Every valid layout of an MCAP file gives what the official reader that does not seek gives."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Attachment, Channel, Header, Message, Metadata, Schema
from mcap_layouts import Contents, Layout, all_layouts, file_of
from sample_logs import write_toy_log

from replayers.doctor.examine import examine
from replayers.doctor.findings import Level, Verdict
from replayers.log_tools.copy_log import LogLayout, ReadLoss, contents
from replayers.log_tools.info import describe
from replayers.log_tools.notes import IncompleteIndex, add_note, notes_of
from replayers.log_tools.rewrite import MessageFilter, filtered, merge_logs
from replayers.mcap_io.reader import attachment, messages, metadata
from replayers.runs.run import read
from replayers.runs.sensor_index import sensor_tracks
from workbench import cli

LAYOUTS = list(all_layouts())
SOME = LAYOUTS[::53]
"""A prime step: every option is met both on and off."""
PLAIN = Layout()
SECOND = 10**9


def _small() -> Contents:
    text = Schema(id=1, name="Text", encoding="jsonschema", data=b'{"type": "object"}')
    times = [(1, 5), (2, 6), (1, 7), (3, 9), (1, 8), (2, 11), (3, 12), (1, 13)]
    return Contents(
        schemas=[text],
        channels=[
            Channel(id=1, topic="/a", message_encoding="json", metadata={}, schema_id=1),
            Channel(id=2, topic="/b", message_encoding="json", metadata={"x": "y"}, schema_id=1),
            Channel(id=3, topic="/c", message_encoding="raw", metadata={}, schema_id=0),
        ],
        messages=[
            Message(channel_id=c, log_time=t * SECOND, data=b'{"n": %d}' % n, publish_time=t * SECOND, sequence=n)
            for n, (c, t) in enumerate(times)
        ],
        others=[
            Attachment(create_time=1, log_time=9 * SECOND, name="a.txt", media_type="text/plain", data=b"hello"),
            Metadata(name="facts", metadata={"k": "v"}),
        ],
    )


def _official(data: bytes) -> list[tuple[str, int, int, bytes]]:
    reader = NonSeekingReader(io.BytesIO(data))
    found = reader.iter_messages(log_time_order=False)
    return [(channel.topic, m.log_time, m.sequence, m.data) for _, channel, m in found]


def _ours(path: Path, **wanted: object) -> list[tuple[str, int, int, bytes]]:
    return [(m.topic, m.log_time, m.sequence, m.data) for m in messages(path, **wanted)]  # pyright: ignore


def _check(layout: Layout, path: Path) -> None:
    data = file_of(_small(), layout)
    path.write_bytes(data)
    expected = _official(data)
    assert len(expected) == 8
    assert _ours(path) == expected
    assert _ours(path, topics={"/a", "/c"}.__contains__) == [m for m in expected if m[0] != "/b"]
    window = _ours(path, start_ns=7 * SECOND, end_ns=12 * SECOND)
    assert window == [m for m in expected if 7 * SECOND <= m[1] < 12 * SECOND]
    assert attachment(path, "a.txt") == b"hello"
    assert metadata(path, "facts") == {"k": "v"}
    found = describe(path)
    assert (found.closed, found.loss.count, found.index.messages) == (True, 0, 8)
    assert (found.index.first_ns, found.index.last_ns) == (5 * SECOND, 13 * SECOND)
    assert {c["topic"]: c["messages"] for c in found.channels()} == {"/a": 4, "/b": 2, "/c": 2}
    assert [a.name for a in found.index.attachments] == ["a.txt"]
    assert found.metadata == {"facts": {"k": "v"}}
    examined = examine(path)
    assert examined.verdict is Verdict.FINE, examined.findings
    assert {finding.level for finding in examined.findings} <= {Level.INFO}
    assert examined.messages == 8
    for copy, made in (
        ("filtered", lambda out: filtered(path, out, MessageFilter(), LogLayout(force=True))),
        ("merged", lambda out: merge_logs([path], out, LogLayout(force=True))),
    ):
        output = path.with_name(f"{copy}.mcap")
        made(output)
        assert sorted(_ours(output)) == sorted(expected), copy
        assert len([p for p in contents(output, ReadLoss()) if isinstance(p, Attachment | Metadata)]) == 2
    _check_note(path, data, expected)


def _check_note(path: Path, data: bytes, before: list[tuple[str, int, int, bytes]]) -> None:
    """A note is refused and changes nothing, or every reader finds it beside all that was there."""
    try:
        add_note(path, "seen", at="2")
    except IncompleteIndex:
        assert path.read_bytes() == data
        return
    with path.open("rb") as stream:
        found = [(c.topic, m.log_time, m.sequence, m.data) for _, c, m in make_reader(stream).iter_messages()]
    assert sorted(m for m in found if m[0] != "/notes") == sorted(before)
    assert [note.text for note in notes_of(path)] == ["seen"]
    assert examine(path).verdict is Verdict.FINE


def test_some_layouts_are_read_whole(tmp_path: Path):
    for layout in SOME:
        _check(layout, tmp_path / "a.mcap")


@pytest.mark.slow
@pytest.mark.parametrize("part", range(8))
def test_all_layouts_are_read_whole(tmp_path: Path, part: int):
    for layout in LAYOUTS[part::8]:
        _check(layout, tmp_path / "a.mcap")


def test_messages_outside_of_chunks_beside_chunks_are_read(tmp_path: Path):
    """Chunked and loose messages in one file: the chunk indexes are right and do not hold everything."""
    small = _small()
    data = file_of(small, Layout(statistics=False))
    loose = small.messages[0]
    from mcap_layouts import raw

    at = data.index(raw(small.others[0]))
    again = raw(small.schemas[0]) + raw(small.channels[0]) + raw(loose)
    path = tmp_path / "a.mcap"
    path.write_bytes(_shifted(data, at, again))
    assert len(_ours(path, topics="/a".__eq__)) == 5
    with pytest.raises(IncompleteIndex):
        add_note(path, "seen")


def _shifted(data: bytes, at: int, more: bytes) -> bytes:
    """The file with more bytes in its data, all offsets of its summary moved by hand."""
    from mcap.stream_reader import StreamReader
    from mcap_layouts import MAGIC, raw

    parts, moved = bytearray(MAGIC), len(more)
    ended = False
    for record in StreamReader(io.BytesIO(data), emit_chunks=True).records:
        name = type(record).__name__
        if name == "SummaryOffset":
            continue
        if len(parts) == at:
            parts += more
        if name == "ChunkIndex":
            record.chunk_start_offset += moved
            record.message_index_offsets = {k: v + moved for k, v in record.message_index_offsets.items()}
        elif name in ("AttachmentIndex", "MetadataIndex"):
            record.offset += moved
        elif name == "Footer":
            record.summary_start += moved
            record.summary_offset_start = record.summary_crc = 0
        ended = ended or isinstance(record, Header)
        parts += raw(record)
    return bytes(parts) + MAGIC


@pytest.fixture(scope="module")
def run_contents(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Contents]:
    path = write_toy_log(tmp_path_factory.mktemp("layouts") / "a.mcap")
    found = Contents()
    ids: dict[tuple[str, int], int] = {}
    for part in contents(path, ReadLoss()):
        if isinstance(part, Attachment | Metadata):
            found.others.append(part)
        elif not isinstance(part, Header):
            if part.channel.id not in ids.values():
                ids[part.topic, part.channel.id] = part.channel.id
                found.channels.append(part.channel)
                if part.schema and part.schema not in found.schemas:
                    found.schemas.append(part.schema)
            found.messages.append(
                Message(
                    channel_id=part.channel.id,
                    log_time=part.log_time,
                    data=part.data,
                    publish_time=part.publish_time,
                    sequence=part.sequence,
                )
            )
    return path, found


@pytest.mark.parametrize(
    "layout",
    [
        Layout(chunked=False, chunk_index=False, message_index=False),
        Layout(chunk_index=False),
        Layout(message_index=False, repeated_channels=False),
        Layout(repeated_channels=False, repeated_schemas=False, statistics=False),
        Layout(other_indexes=False, around="after"),
    ],
)
def test_a_run_is_read_whatever_its_layout(
    run_contents: tuple[Path, Contents], layout: Layout, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    original, held = run_contents
    path = tmp_path / "a.mcap"
    path.write_bytes(file_of(held, layout, chunk_messages=20))
    run, expected = read(path), read(original)
    assert (run.complete, run.damage) == (True, ())
    for name in ("observations", "beliefs", "plans", "actions", "outcome", "raw_poses"):
        assert getattr(run, name) == getattr(expected, name), name
    assert read(path, with_poses=False) == replace(run, raw_poses=())
    assert {t: len(v.stamps_ns) for t, v in sensor_tracks(path).tracks.items()} == {
        t: len(v.stamps_ns) for t, v in sensor_tracks(original).tracks.items()
    }
    assert cli.run(["log", "cat", str(path), "--json"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(held.messages)


@pytest.mark.slow
def test_a_run_without_an_index_is_replayed_as_with_one(
    run_contents: tuple[Path, Contents], tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    original, held = run_contents
    path = tmp_path / "a.mcap"
    path.write_bytes(file_of(held, Layout(chunk_index=False), chunk_messages=20))
    answers: list[dict[str, object]] = []
    for log in (path, original):
        assert cli.run(["replay", str(log), "-s", "opt-greedy", "--json"]) == 0
        row = json.loads(capsys.readouterr().out)["rows"][0]
        answers.append({name: row[name] for name in ("status", "lower", "upper", "exact", "notes")})
    assert answers[0] == answers[1]
