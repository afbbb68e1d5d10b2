"""Logs played to viewers, with clients that speak Foxglove's WebSocket protocol."""

from __future__ import annotations

import asyncio
import json
import shutil
import struct
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from sample_logs import write_toy_log
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin, Subprotocol

from recorders.foxglove.live_server import ServedAt
from recorders.foxglove.relay import OLD, SDK, CannotServe, is_allowed, names_this_server
from replayers.mcap_io.reader import messages
from replayers.serving.player import Player

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
MESSAGE, TIME, STATE = 1, 2, 5
PLAY, PAUSE = 0, 1
PAUSED, ENDED = 1, 3
NPM_PACKAGE = "@foxglove/ws-protocol@0.8.0"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_toy_log(tmp_path_factory.mktemp("logs") / "run.mcap")


@pytest.fixture
def player(log: Path) -> Iterator[Player]:
    made = Player([log], ServedAt(port=0), paused=True)
    yield made
    made.close()


class Viewer:
    """A client that subscribes to everything and keeps what it gets."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.topics: dict[int, str] = {}
        self.info: dict[str, Any] = {}
        self.shown: list[tuple[str, int]] = []
        self.states: list[int] = []

    async def subscribe(self) -> None:
        self.info = json.loads(await self.socket.recv())
        channels = json.loads(await self.socket.recv())["channels"]
        self.topics = {channel["id"]: channel["topic"] for channel in channels}
        wanted = [{"id": number, "channelId": number} for number in self.topics]
        await self.socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    async def control(self, command: int, *, speed: float = 1.0, seek_ns: int | None = None) -> None:
        head = struct.pack("<BBfBQI", 3, command, speed, seek_ns is not None, seek_ns or 0, 1)
        await self.socket.send(head + b"r")

    async def take(
        self, *, until: int | None = None, quiet_s: float = 0.3, enough: Callable[[Viewer], bool] | None = None
    ) -> None:
        """Frames until a state of playing is told, there is enough, or it is quiet."""
        while enough is None or not enough(self):
            try:
                frame = await asyncio.wait_for(self.socket.recv(), quiet_s if until is None else 60)
            except TimeoutError:
                return
            if isinstance(frame, bytes) and frame[0] == MESSAGE:
                number, time_ns = struct.unpack_from("<IQ", frame, 1)
                self.shown.append((self.topics[number], time_ns))
            elif isinstance(frame, bytes) and frame[0] == STATE:
                self.states.append(frame[1])
                if frame[1] == until:
                    return


def with_viewer(player: Player, steps: Any, *, name: Subprotocol = SDK) -> Viewer:
    async def run() -> Viewer:
        async with connect(player.server.address, subprotocols=[name], max_size=None, close_timeout=0.2) as socket:
            viewer = Viewer(socket)
            await viewer.subscribe()
            await steps(viewer)
            return viewer

    return asyncio.run(run())


def test_every_message_is_shown_by_the_end_and_the_end_is_told(player: Player, log: Path) -> None:
    async def steps(viewer: Viewer) -> None:
        await viewer.control(PLAY, speed=100.0)
        await viewer.take(until=ENDED)
        await viewer.take(quiet_s=60, enough=lambda viewer: {*later} <= {*viewer.shown})
        await viewer.take()  # nothing comes twice

    times = [m.log_time for m in messages(log)]
    later = sorted((m.topic, m.log_time) for m in messages(log) if m.log_time > min(times))
    viewer = with_viewer(player, steps)
    span = viewer.info["dataStartTime"], viewer.info["dataEndTime"]
    assert [t["sec"] * 10**9 + t["nsec"] for t in span] == [min(times), max(times)]
    assert sorted(shown for shown in viewer.shown if shown[1] > min(times)) == later
    assert viewer.states[-1] == ENDED


def test_a_seek_shows_how_everything_stood_and_a_pause_shows_no_more(player: Player, log: Path) -> None:
    everything = [(m.topic, m.log_time) for m in messages(log)]
    first = {(topic, time) for topic, time in everything if time == min(time for _, time in everything)}
    middle = sorted(time for _, time in everything)[len(everything) // 2]
    stood = {topic: time for topic, time in sorted(everything, key=lambda m: m[1]) if time <= middle}
    later = {*stood.items()} - first

    async def steps(viewer: Viewer) -> None:
        await viewer.take(quiet_s=60, enough=lambda viewer: first <= {*viewer.shown})
        viewer.shown.clear()
        await viewer.control(PAUSE, seek_ns=middle)
        await viewer.take(quiet_s=60, enough=lambda viewer: PAUSED in viewer.states and later <= {*viewer.shown})
        await viewer.take()  # no more

    viewer = with_viewer(player, steps)
    assert dict(viewer.shown) == stood
    assert sorted(shown for shown in viewer.shown if shown not in first) == sorted(later), "each once"
    assert len(later) > 3
    assert player.now_ns == middle
    assert PAUSED in viewer.states


def test_a_viewer_without_controls_gets_the_log_by_subscribing(log: Path) -> None:
    player = Player([log], ServedAt(port=0), speed=100.0)
    try:

        async def steps(viewer: Viewer) -> None:
            await viewer.take(quiet_s=60, enough=lambda viewer: everything <= {*viewer.shown})

        everything = {(m.topic, m.log_time) for m in messages(log)}
        viewer = with_viewer(player, steps, name=OLD)
        assert everything <= {*viewer.shown}
        assert viewer.states == []  # its protocol does not have them
    finally:
        player.close()


def test_at_the_end_it_begins_again_and_a_viewer_that_left_does_not_hold_it_up(log: Path) -> None:
    last = max(m.log_time for m in messages(log))
    player = Player([log], ServedAt(port=0), speed=100.0, loop=True)

    def begun_again(viewer: Viewer) -> bool:
        times = [time for _, time in viewer.shown]
        return last in times and min(times[times.index(last) :]) < last

    async def steps(viewer: Viewer) -> None:
        await viewer.take(quiet_s=60, enough=begun_again)

    try:
        assert begun_again(with_viewer(player, steps))
    finally:
        began = time.monotonic()
        player.close()
    assert time.monotonic() - began < 9, "it waited for the viewer, as it would for ten seconds"


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://127.0.0.1.evil.example"])
def test_pages_of_strangers_are_refused(player: Player, origin: str) -> None:
    async def run() -> None:
        async with connect(player.server.address, subprotocols=[SDK], origin=Origin(origin)):
            pass

    with pytest.raises(InvalidStatus, match="403"):
        asyncio.run(run())


def test_who_may_connect() -> None:
    for origin in ("https://app.foxglove.dev", "http://localhost:8080", "http://[::1]:3000", "file://", "app://."):
        assert is_allowed(origin, ("https://app.foxglove.dev",))
    for origin in ("https://foxglove.dev.evil.example", "null", "", "http://[", "http://10.0.0.1"):
        assert not is_allowed(origin, ("https://app.foxglove.dev",))
    assert is_allowed("https://viewer.example.org", ("https://viewer.example.org",))
    assert names_this_server("127.0.0.1:8765", "127.0.0.1")
    assert names_this_server("localhost:8765", "127.0.0.1")
    assert names_this_server("192.168.0.5:8765", "0.0.0.0")
    for host in ("rebound.example:8765", "", "192.168.0.5:8765"):
        assert not names_this_server(host, "127.0.0.1")


def test_a_port_in_use_is_one_line(player: Player, log: Path) -> None:
    with pytest.raises(CannotServe, match="Choose another --port"):
        Player([log], ServedAt(port=player.server.port))


@pytest.mark.slow
def test_the_npm_client_gets_the_log(player: Player, tmp_path: Path) -> None:
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("no npm or node here")
    fetched = subprocess.run(
        [npm, "install", "--no-audit", "--no-fund", NPM_PACKAGE, "ws@8"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    if fetched.returncode:
        pytest.skip(f"npm does not reach {NPM_PACKAGE}")
    (tmp_path / "client.js").write_text(
        """
        const { FoxgloveClient } = require("@foxglove/ws-protocol");
        const WebSocket = require("ws");
        const client = new FoxgloveClient({
          ws: new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]),
        });
        const topics = new Set(), byId = new Map();
        client.on("error", (error) => { console.error(String(error)); process.exit(1); });
        client.on("advertise", (channels) => channels.forEach((c) => byId.set(client.subscribe(c.id), c.topic)));
        client.on("message", (message) => topics.add(byId.get(message.subscriptionId)));
        setTimeout(() => { console.log(JSON.stringify([...topics])); process.exit(0); }, 1500);
        """,
        encoding="utf-8",
    )
    ran = subprocess.run(
        [node, "client.js", player.server.address], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert "/map" in json.loads(ran.stdout)
