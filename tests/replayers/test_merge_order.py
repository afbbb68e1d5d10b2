"""Recordings that overlap, and a log with one of its own parts, become one log in which every message stands once."""

from __future__ import annotations

from pathlib import Path

import pytest

from recorders.mcap_io.writer import McapWriter
from replayers.doctor.examine import examine
from replayers.doctor.findings import Verdict
from replayers.log_tools.copy_log import LogLayout
from replayers.log_tools.rewrite import MessageFilter, filtered, merge_logs, split_log
from replayers.mcap_io.reader import messages
from replayers.runs.gaps import gaps_of
from replayers.runs.run import read

LOG = Path(__file__).parents[2] / "logs" / "deliver-3.mcap"
STYLE = LogLayout(force=True)


def _held(path: Path) -> list[tuple[str, int, int, bytes]]:
    return sorted((m.topic, m.log_time, m.sequence, m.data) for m in messages(path))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
@pytest.mark.parametrize("shares", [(0.3, 0.7), (0.0, 1.0), (0.5, 0.5)])
def test_recordings_that_overlap_give_every_message_once(
    shares: tuple[float, float], order: tuple[int, int], tmp_path: Path
):
    stamps = [action.stamp.ns for action in read(LOG).actions]
    begin, end = (stamps[round(share * (len(stamps) - 1))] for share in shares)
    halves = [tmp_path / "first.mcap", tmp_path / "second.mcap"]
    filtered(LOG, halves[0], MessageFilter(end_ns=end + 1), STYLE)
    filtered(LOG, halves[1], MessageFilter(start_ns=begin), STYLE)
    merge_logs([halves[number] for number in order], tmp_path / "both.mcap", STYLE)
    assert _held(tmp_path / "both.mcap") == _held(LOG)
    assert gaps_of(read(tmp_path / "both.mcap")).lost == ()


def test_a_log_and_one_of_its_parts_give_the_log(tmp_path: Path):
    part = split_log(LOG, tmp_path / "part.mcap", STYLE, part_s=40).outputs[1]
    done = merge_logs([LOG, part], tmp_path / "both.mcap", STYLE)
    assert done.parts_missing == ()
    assert done.dropped > 0
    assert _held(tmp_path / "both.mcap") == _held(LOG)
    assert examine(tmp_path / "both.mcap").verdict is Verdict.FINE
    assert gaps_of(read(tmp_path / "both.mcap")).lost == ()


def test_equal_messages_of_one_log_and_unlike_ones_of_two_stay(tmp_path: Path):
    """A camera that stands still may give the same picture twice, and two logs may number their messages alike."""
    for name, data in (("a", b"same"), ("b", b"else")):
        with McapWriter(tmp_path / f"{name}.mcap") as writer:
            channel = writer.add_channel("/t", "x", 0)
            for _ in range(2):
                writer.add_message(channel, data, log_time=5, sequence=0)
            writer.add_message(channel, b"both", log_time=5, sequence=1)
    merge_logs([tmp_path / "a.mcap", tmp_path / "b.mcap"], tmp_path / "c.mcap", STYLE)
    assert sorted(m.data for m in messages(tmp_path / "c.mcap")) == [b"both", b"else", b"else", b"same", b"same"]
