"""Sinks: nothing is lost between parts, a moment can be saved afterwards, and the robot never waits for the disk."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from pathlib import Path

import pytest

from recorders.mcap_io.channels import ChannelSpec
from recorders.mcap_io.file import LogInUse, lock_file
from recorders.mcap_io.writer import DiskFull
from recorders.sinks.files import PART_METADATA, LogFiles, SplitLimits
from recorders.sinks.ring_buffer import RingBuffer
from recorders.sinks.threaded import ThreadedSink
from replayers.mcap_io.reader import attachment, messages, metadata
from replayers.mcap_io.summary import read_index
from workbench.errors import BadValue, OutputExists
from workbench.log_schema.codec import decode
from workbench.log_schema.events import NANO, Dropped

CAMERA = ChannelSpec(topic="/camera", message_encoding="x")
STATE = ChannelSpec(topic="/state", message_encoding="x", important=True)
MAP = ChannelSpec(topic="/map", message_encoding="x", latched=True)


def _data(path: Path, topic: str) -> list[bytes]:
    return [m.data for m in messages(path, topics=topic.__eq__)]


def test_parts_follow_each_other_without_a_gap_and_repeat_what_stands(tmp_path: Path):
    files = LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_bytes=5000), chunk_bytes=1000, compression="")
    files.attach("place.json", "application/json", b"{}", log_time=1)
    files.describe("lios.run", {"run_id": "r"})
    files.write(MAP, b"the map", log_time=1)
    for i in range(40):
        files.write(CAMERA, bytes([i]) * 500, log_time=10 + i)
    files.close()
    assert len(files.parts) > 2
    seen = [data[0] for part in files.parts for data in _data(part, "/camera")]
    assert seen == list(range(40))
    for number, part in enumerate(files.parts):
        assert attachment(part, "place.json") == b"{}"
        assert metadata(part, "lios.run") == {"run_id": "r"}
        assert _data(part, "/map") == [b"the map"]
        assert (metadata(part, PART_METADATA) or {})["part"] == str(number)
        stamps = [m.log_time for m in messages(part)]
        assert stamps == sorted(stamps)


def test_a_part_ends_by_time(tmp_path: Path):
    files = LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_s=1.0))
    for i in range(30):
        files.write(CAMERA, b"x", log_time=i * NANO // 10)
    files.close()
    assert [len(_data(part, "/camera")) for part in files.parts] == [10, 10, 10]


def test_a_split_of_nothing_is_refused():
    with pytest.raises(BadValue):
        SplitLimits(part_bytes=0)
    with pytest.raises(BadValue):
        SplitLimits(part_s=-1.0)


def test_parts_of_an_earlier_log_stop_nothing_midway(tmp_path: Path):
    """A part left over from before would end the recording when its number comes; it is refused before it begins."""
    left_over = tmp_path / "a_0003.mcap"
    left_over.write_bytes(b"mine")
    with pytest.raises(OutputExists, match="a_0003"):
        LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_s=1.0))
    assert list(tmp_path.iterdir()) == [left_over]
    LogFiles(tmp_path / "a.mcap").close()
    LogFiles(tmp_path / "b.mcap", split=SplitLimits(part_s=1.0)).close()
    files = LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_s=1.0), force=True)
    for i in range(40):
        files.write(CAMERA, b"x", log_time=i * NANO // 10)
    files.close()
    assert _data(left_over, "/camera") == [b"x"] * 10


def test_a_shorter_log_in_place_of_a_longer_one_leaves_no_part_of_it(tmp_path: Path):
    """They would be merged as one; what is no part of it stays."""
    year = tmp_path / "a_2024.mcap"
    year.write_bytes(b"mine")
    for seconds in (40, 20):
        files = LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_s=1.0), force=True)
        for i in range(seconds):
            files.write(CAMERA, b"x", log_time=i * NANO // 10)
        files.close()
    assert sorted(tmp_path.iterdir()) == [*files.parts, year]
    assert len(files.parts) == 2


def test_parts_that_another_process_writes_stay(tmp_path: Path):
    for number in range(3):
        (tmp_path / f"a_{number:04d}.mcap").write_bytes(b"x")
    there = sorted(tmp_path.iterdir())
    with open(there[2], "rb") as theirs:
        lock_file(theirs, there[2])
        with pytest.raises(LogInUse):
            LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_s=1.0), force=True)
    assert [path.read_bytes() for path in there] == [b"x"] * 3


def test_a_recording_that_must_stop_is_closed_with_its_index(tmp_path: Path):
    """The next part cannot be made: the one before is whole all the same."""
    told: list[str] = []
    files = LogFiles(tmp_path / "a.mcap", split=SplitLimits(part_s=1.0))
    background = ThreadedSink(files, on_trouble=told.append)
    for i in range(10):
        background.write(STATE, b"%d" % i, log_time=i)
    assert background.wait(60)
    (tmp_path / "a_0001.mcap").mkdir()
    background.write(STATE, b"next", log_time=2 * NANO)
    background.close()
    assert len(told) == 1
    assert _data(tmp_path / "a_0000.mcap", "/state") == [b"%d" % i for i in range(10)]
    with open(tmp_path / "a_0000.mcap", "rb") as stream:
        assert read_index(stream) is not None


def test_a_ring_buffer_saves_the_last_seconds_and_what_stands(tmp_path: Path):
    ring = RingBuffer(tmp_path / "moment.mcap", keep_s=2.0)
    ring.attach("place.json", "application/json", b"{}", log_time=0)
    ring.write(MAP, b"the map", log_time=0)
    for i in range(100):
        ring.write(STATE, b"%d" % i, log_time=i * NANO // 10, publish_time=5)
    path = ring.save()
    assert _data(path, "/state") == [b"%d" % i for i in range(79, 100)]
    assert _data(path, "/map") == [b"the map"]
    assert attachment(path, "place.json") == b"{}"
    assert (metadata(path, PART_METADATA) or {})["last_s"] == "2", "a part of a run, so nobody misses its beginning"
    ring.write(STATE, b"later", log_time=10 * NANO)
    assert _data(ring.save(tmp_path / "again.mcap"), "/state")[-1] == b"later"


def test_a_ring_buffer_holds_no_more_than_its_bytes(tmp_path: Path):
    ring = RingBuffer(tmp_path / "kept.mcap", keep_s=1e6, keep_bytes=10_000)
    for i in range(1000):
        ring.write(CAMERA, bytes(1000), log_time=i)
    kept = [m.log_time for m in messages(ring.save()) if m.topic == CAMERA.topic]
    assert 0 < len(kept) <= 10
    assert kept == list(range(1000 - len(kept), 1000))


class SlowSink:
    """A disk that takes its time, or is full."""

    def __init__(self, path: Path, *, wait_s: float = 0.0, full_after: int | None = None) -> None:
        self.path = path
        self.written: list[tuple[str, bytes]] = []
        self.flushed = self.closed = 0
        self.go = threading.Event()
        self.go.set()
        self._wait_s, self._full_after = wait_s, full_after

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        self.go.wait(60)
        if self._full_after is not None and len(self.written) >= self._full_after:
            raise DiskFull(self.path, "no space left")
        self.written.append((channel.topic, data))
        return True

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        self.written.append((name, data))

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        self.written.append((name, b""))

    def flush(self) -> None:
        self.flushed += 1

    def close(self) -> None:
        self.closed += 1


def test_in_the_background_everything_arrives_in_order(tmp_path: Path):
    sink = SlowSink(tmp_path / "a.mcap")
    background = ThreadedSink(sink)
    background.describe("first", {})
    for i in range(100):
        assert background.write(STATE, b"%d" % i, log_time=i)
    assert background.wait(60)
    assert sink.written == [("first", b""), *(("/state", b"%d" % i) for i in range(100))]
    assert sink.flushed >= 1
    background.close()
    background.close()
    assert sink.closed == 1
    assert not background.write(STATE, b"after", log_time=0)


def test_when_the_disk_cannot_keep_up_pictures_go_first_and_the_loss_is_written_down(tmp_path: Path):
    sink = SlowSink(tmp_path / "a.mcap")
    sink.go.clear()
    background = ThreadedSink(sink, queue_bytes=10_000, clock_ns=lambda: 42)
    taken = [background.write(CAMERA, bytes(1000), log_time=i) for i in range(30)]
    assert 5 <= sum(taken) <= 11
    assert background.write(STATE, b"decision", log_time=31)
    refused = 30 - sum(taken)
    assert background.dropped == {"/camera": refused}
    sink.go.set()
    background.close()
    assert ("/state", b"decision") in sink.written
    topic, data = sink.written[-1]
    assert topic == "/recorder/dropped"
    event = decode(topic, data)
    assert isinstance(event, Dropped)
    assert event.counts == {"/camera": refused}


def test_memory_is_bounded_even_for_what_is_important(tmp_path: Path):
    sink = SlowSink(tmp_path / "a.mcap")
    sink.go.clear()
    background = ThreadedSink(sink, queue_bytes=10_000)
    taken = [background.write(STATE, bytes(1000), log_time=i) for i in range(100)]
    assert sum(taken) * 1000 <= 2 * 10_000 + 1000, "no more than twice the queue, and the one being written"
    sink.go.set()
    background.close()


def test_a_full_disk_stops_the_recording_and_not_the_robot(tmp_path: Path):
    told: list[str] = []
    sink = SlowSink(tmp_path / "a.mcap", full_after=3)
    background = ThreadedSink(sink, on_trouble=told.append)
    for i in range(10):
        background.write(STATE, b"x", log_time=i)
    assert not background.wait(60)
    assert background.write(STATE, b"x", log_time=11) is False
    assert background.dropped["/state"] >= 1
    background.close()
    assert len(sink.written) == 3
    assert len(told) == 1
    assert "no space left" in told[0]
    assert isinstance(background.stop_reason, DiskFull)


def test_everything_is_synced_at_least_every_second(tmp_path: Path):
    sink = SlowSink(tmp_path / "a.mcap")
    background = ThreadedSink(sink, sync_s=0.1)
    background.write(STATE, b"x", log_time=0)
    deadline = time.monotonic() + 60
    while not sink.flushed and time.monotonic() < deadline:
        time.sleep(0.01)
    assert sink.flushed == 1
    time.sleep(0.3)
    assert sink.flushed == 1, "nothing new, nothing to sync"
    background.close()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_mistake_in_the_recorder_is_told_and_not_swallowed(tmp_path: Path):
    told: list[str] = []
    background = ThreadedSink(SlowSink(tmp_path / "a.mcap"), on_trouble=told.append)
    background.submit(lambda: 1 / 0)
    assert not background.wait(60)
    background.close()
    assert "error in the recorder" in told[0]
