"""Runs that are shown to viewers while they are recorded."""

from __future__ import annotations

import asyncio
import json
import struct
from pathlib import Path

import pytest
from websockets.asyncio.client import connect

import recorders
from recorders.foxglove.live_server import LiveServer, ServedAt
from recorders.foxglove.relay import SDK
from recorders.mcap_io.channels import ChannelSpec
from recorders.sinks.files import LogFiles
from recorders.sinks.mirrored import MirroredSink, watched
from replayers.mcap_io.reader import messages

CHANNEL = ChannelSpec(topic="/a", message_encoding="json", latched=True)


class Watching:
    """Keeps what it is shown, and breaks after so many messages."""

    def __init__(self, breaks_after: int = 10**9) -> None:
        self.shown: list[tuple[str, int, bytes]] = []
        self.left = breaks_after

    def publish(self, channel: ChannelSpec, data: bytes, *, log_time: int) -> None:
        if len(self.shown) >= self.left:
            raise RuntimeError("the network is gone")
        self.shown.append((channel.topic, log_time, data))


def test_viewers_are_shown_the_log_message_by_message_and_the_log_stays_the_same(tmp_path: Path) -> None:
    watching = Watching()
    recorders.record(tmp_path / "alone.mcap", find="mug", estimator="counts")
    recorders.record(tmp_path / "shown.mcap", find="mug", estimator="counts", audience=watching)
    shown, alone = list(messages(tmp_path / "shown.mcap")), list(messages(tmp_path / "alone.mcap"))
    assert watching.shown == [(m.topic, m.log_time, m.data) for m in shown]
    untimed = [[(m.topic, m.log_time, m.data) for m in log if m.topic != "/search/timing"] for log in (shown, alone)]
    assert untimed[0] == untimed[1]


def test_viewers_that_break_end_the_showing_and_not_the_recording(tmp_path: Path) -> None:
    said: list[str] = []
    watching = Watching(breaks_after=2)
    sink = MirroredSink(LogFiles(tmp_path / "log.mcap"), watching, on_trouble=said.append)
    for k in range(5):
        assert sink.write(CHANNEL, b"{}", log_time=k)
    sink.close()
    assert len(list(messages(sink.path))) == 5
    assert len(watching.shown) == 2
    assert said == ["Viewers are no longer served: the network is gone. Recording goes on."]


def test_without_a_port_nothing_is_served() -> None:
    with watched("run.mcap", None) as audience:
        assert audience is None


def test_who_comes_late_sees_the_last_message_of_latched_topics() -> None:
    pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
    server = LiveServer("run.mcap", ServedAt(port=0))

    async def come_late() -> tuple[int, bytes]:
        async with connect(server.address, subprotocols=[SDK]) as socket:
            await socket.recv()
            channel = json.loads(await socket.recv())["channels"][0]
            wanted = [{"id": 1, "channelId": channel["id"]}]
            await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
            frame = await asyncio.wait_for(socket.recv(), 60)
            assert isinstance(frame, bytes)
            return struct.unpack_from("<BIQ", frame)[2], frame[13:]

    try:
        for k in range(3):
            server.publish(CHANNEL, b'{"k":%d}' % k, log_time=k)
        assert asyncio.run(come_late()) == (2, b'{"k":2}')
    finally:
        server.close()
