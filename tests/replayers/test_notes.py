"""Notes added to a log: they change nothing else, lie within it and are never lost."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from mcap.reader import make_reader
from sample_logs import T0, killed_toy_log, write_toy_log

from replayers.doctor.examine import examine
from replayers.doctor.findings import Verdict
from replayers.log_tools.notes import add_note, notes_of
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from workbench import cli
from workbench.log_schema.events import NANO

Facts = tuple[str, int, int, int, bytes]


def _facts(path: Path) -> list[Facts]:
    return [(m.topic, m.log_time, m.publish_time, m.sequence, m.data) for m in messages(path)]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_toy_log(tmp_path / "a.mcap")


def _lios(*args: str | Path) -> int:
    return cli.run([str(arg) for arg in args])


def test_notes_of_two_people_at_once_are_both_kept(log: Path):
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda i: add_note(log, f"note {i}", at=str(i % 10)), range(24)))
    assert {note.text for note in notes_of(log)} == {f"note {i}" for i in range(24)}
    assert examine(log).verdict is Verdict.FINE


def test_a_note_lies_within_the_log(log: Path, capsys: pytest.CaptureFixture[str]):
    before = log.read_bytes()
    assert _lios("log", "note", log, "typo", "--at", "99999") == 2
    assert "within the log, 0 to 15.000 seconds" in capsys.readouterr().err
    assert _lios("log", "note", log, "typo", "--at", "5", "--until", "4") == 2
    assert log.read_bytes() == before


def test_a_note_has_words(log: Path, capsys: pytest.CaptureFixture[str]):
    before = log.read_bytes()
    assert cli.run(["log", "note", str(log), "  "]) == 2
    assert cli.run(["log", "note", str(log), "--at", "3"]) == 2
    assert "some words" in capsys.readouterr().err
    assert log.read_bytes() == before


def test_a_note_for_which_there_is_no_room_changes_nothing(log: Path, monkeypatch: pytest.MonkeyPatch):
    """A file may grow no further, as on a full disk: the log is what it was, index and all."""
    before = log.read_bytes()
    script = (
        "import resource, sys\n"
        "from replayers.log_tools.notes import add_note\n"
        "from recorders.mcap_io.writer import DiskFull\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({len(before) + 10}, -1))\n"
        f"try: add_note({str(log)!r}, 'x' * 5000)\n"
        "except DiskFull: sys.exit(7)"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False, timeout=60).returncode == 7
    assert log.read_bytes() == before


def test_a_note_changes_nothing_else(log: Path):
    before, facts = log.read_bytes(), _facts(log)
    add_note(log, "door was stuck", at="12.4", author="me", now_ns=5)
    add_note(log, "naïve 'quotes' ✓", at="3", until="4.5", now_ns=6)
    found = notes_of(log)
    assert [(n.text, n.start_ns - T0, n.end_ns - T0, n.author, n.written_ns) for n in found] == [
        ("naïve 'quotes' ✓", 3 * NANO, 4_500_000_000, "", 6),
        ("door was stuck", 12_400_000_000, 12_400_000_000, "me", 5),
    ]
    after = log.read_bytes()
    common = next(i for i, (a, b) in enumerate(zip(before, after, strict=False)) if a != b)
    with open(log, "rb") as stream:
        summary = make_reader(stream, validate_crcs=True).get_summary()
    assert summary is not None
    assert common > max(c.chunk_start_offset for c in summary.chunk_indexes[:-2])
    assert [f for f in _facts(log) if f[0] != "/notes"] == facts
    assert examine(log).verdict is Verdict.FINE
    (schema,) = {m.schema.name for m in messages(log, topics="/notes".__eq__) if m.schema}
    assert schema == "foxglove.Event"
    assert read(log).complete


def test_a_note_to_a_log_that_is_still_open_is_refused(tmp_path: Path):
    path = killed_toy_log(tmp_path / "k.mcap")
    before = path.read_bytes()
    assert _lios("log", "note", path, "x") == 2
    assert path.read_bytes() == before
