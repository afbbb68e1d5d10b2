"""Logs read by time, against all of their messages read in one go."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from sample_logs import write_toy_log

from recorders.mcap_io.writer import McapWriter
from replayers.mcap_io.reader import messages
from replayers.mcap_io.scan import Damage
from replayers.serving.played_logs import NoIndex, PlayedLogs, PlayedMessage


def written(path: Path, *, topics: int = 3, count: int = 60, chunk_bytes: int = 200) -> Path:
    """Messages of several topics, in many chunks, not in the order of their times."""
    with McapWriter(path, chunk_bytes=chunk_bytes) as writer:
        schema = writer.add_schema("note", "jsonschema", b'{"type":"object"}')
        channels = [writer.add_channel(f"/t{k}", "json", schema, {}) for k in range(topics)]
        for k in range(count):
            late = 700 if k % 7 == 0 else 0
            writer.add_message(channels[k * k % topics], b'{"k":%d}' % k, log_time=1000 + 100 * k - late)
    return path


def whole(path: Path, damage: Damage) -> None:
    pytest.fail(f"{path}: {damage}")


def in_one_go(path: Path) -> list[tuple[str, int, bytes]]:
    return [(m.topic, m.log_time, m.data) for m in messages(path)]


def plain(shown: list[PlayedMessage]) -> list[tuple[str, int, bytes]]:
    return [(s.channel.topic, s.log_time, s.data) for s in shown]


def test_stretches_together_are_the_whole_log_in_the_order_of_times(tmp_path: Path) -> None:
    log = written(tmp_path / "log.mcap")
    with PlayedLogs([log], on_damage=whole) as played:
        steps = [*range(played.start_ns - 1, played.end_ns, 333), played.end_ns]
        found = [m for a, b in pairwise(steps) for m in plain(played.between(a, b))]
    assert len(found) == 60
    assert sorted(found) == sorted(in_one_go(log))
    assert [time for _, time, _ in found] == sorted(time for _, time, _ in found)


def test_what_stands_at_a_moment_is_the_last_message_of_every_channel(tmp_path: Path) -> None:
    log = written(tmp_path / "log.mcap")
    everything = in_one_go(log)
    with PlayedLogs([log], on_damage=whole) as played:
        for moment in range(played.start_ns - 1, played.end_ns + 200, 50):
            last: dict[str, tuple[str, int, bytes]] = {}
            for message in everything:
                known = last.get(message[0])
                if message[1] <= moment and (known is None or message[1] >= known[1]):
                    last[message[0]] = message
            assert sorted(plain(played.standing_at(moment))) == sorted(last.values())


def test_topics_of_several_logs_are_told_apart_only_where_they_clash(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    logs = [
        written(tmp_path / "a.mcap", topics=2),
        written(tmp_path / "b.mcap", topics=3),
        written(tmp_path / "other" / "a.mcap", topics=1),
    ]
    with PlayedLogs(logs, on_damage=whole) as played:
        topics = sorted(spec.topic for spec in played.channels())
    assert topics == ["/a-2/t0", "/a/t0", "/a/t1", "/b/t0", "/b/t1"]
    with PlayedLogs([logs[1]], on_damage=whole) as played:
        assert sorted(spec.topic for spec in played.channels()) == ["/t0", "/t1"]


def test_a_log_without_an_index_says_how_to_get_one(tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    log.write_bytes(log.read_bytes()[:-200])
    with pytest.raises(NoIndex, match=r"lios recover .*run\.mcap"):
        PlayedLogs([log], on_damage=whole)
