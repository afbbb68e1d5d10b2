"""Benchmark: the memory of the dashboard's server over an hour of playing three runs, in a few minutes.

    python tests/benchmarks/dashboard_memory.py

The server shows as many moments and tables as an hour at the usual speed has (25 and 4 a second), one after the other
without rest, to a visitor that speaks Viser's protocol and keeps nothing. Prints its resident memory every five
minutes of playing and how much was sent, and fails if the memory grows by more than 2 % from
the tenth minute to the last. LIOS_MINUTES sets the length.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
import time
from pathlib import Path

import msgspec
import psutil
import viser
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from dashboards.viser_app import session as session_module
from dashboards.viser_app.panel import controls
from dashboards.viser_app.server import Dashboard
from dashboards.viser_app.serving import open_dashboard
from dashboards.viser_app.session import BrowserSession

ROOT = Path(__file__).parents[2]
LOGS = [ROOT / "logs" / f"find-{name}.mcap" for name in ("lios", "greedy", "conditioned-lios")]
MINUTES, EVERY_MIN, SETTLED_MIN = float(os.environ.get("LIOS_MINUTES", "60")), 5.0, 10.0
MOMENTS_A_MINUTE = round(60 * session_module.FRAMES_A_SECOND)
TABLES_EVERY = round(session_module.FRAMES_A_SECOND * controls.TABLES_EVERY_S)
"""Moments between two tables."""
MAX_GROWTH = 0.02
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (4.0, -6.0, 12.0),
    "fov": 0.66,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 490,
    "image_width": 556,
    "look_at": (4.0, 4.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class Visitor(threading.Thread):
    """A page that only listens; counts what it is sent."""

    def __init__(self, dashboard: Dashboard) -> None:
        super().__init__(daemon=True)
        self.messages = self.bytes = 0
        self._address = f"ws://127.0.0.1:{dashboard.server.get_port()}/?token={dashboard.token}"

    def run(self) -> None:
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        with connect(self._address, subprotocols=[protocol], compression=None, max_size=None, proxy=None) as socket:
            socket.send(msgspec.msgpack.encode(CAMERA))
            for message in socket:
                self.messages += 1
                self.bytes += len(message)


class Player:
    """Lets a session play without rest, by as much from moment to moment as at the usual speed."""

    def __init__(self, session: BrowserSession) -> None:
        self.moments = 0
        self._session, self._step_s = session, 1 / session_module.FRAMES_A_SECOND
        session_module.FRAMES_A_SECOND = 1e9
        session._advance_playback = self._advance

    def _advance(self, _: float) -> None:
        self.moments += 1
        controls.TABLES_EVERY_S = 0.0 if self.moments % TABLES_EVERY == 0 else 1e9
        self._session.change(at=(self._session.state.at + self._step_s) % self._session.clock.end)

    def wait_for(self, moments: int) -> None:
        while self.moments < moments:
            time.sleep(0.05)


def arrived(dashboard: Dashboard) -> BrowserSession:
    """The session of the visitor."""
    until = time.monotonic() + 60
    while time.monotonic() < until:
        found = next(iter(dashboard.sessions.values()), None)
        if found is not None and found.clock.timelines:
            return found
        time.sleep(0.05)
    raise RuntimeError("the visitor was not let in")


def resident_mb() -> float:
    gc.collect()
    return psutil.Process().memory_info().rss / 1e6


def main() -> int:
    """Plays, prints, and says whether the memory stayed flat."""
    dashboard = open_dashboard(LOGS, port=0)
    visitor = Visitor(dashboard)
    visitor.start()
    session = arrived(dashboard)
    time.sleep(2.0)
    player = Player(session)
    memory: dict[float, float] = {0.0: resident_mb()}
    print(f"{0:3.0f} min {memory[0.0]:7.1f} MB", flush=True)
    session.change(playing=True, loop=True)
    while (minute := max(memory)) < MINUTES:
        minute = min(minute + EVERY_MIN, MINUTES)
        player.wait_for(round(minute * MOMENTS_A_MINUTE))
        memory[minute] = resident_mb()
        sent = f"{visitor.messages} messages, {visitor.bytes / 1e6:.0f} MB sent"
        print(f"{minute:3.0f} min {memory[minute]:7.1f} MB, {player.moments} moments, {sent}", flush=True)
    dashboard.stop()
    first = next((mb for minute, mb in memory.items() if minute >= min(SETTLED_MIN, MINUTES / 2)), memory[0.0])
    growth = list(memory.values())[-1] / first - 1
    print(f"grew by {100 * growth:.1f} % from minute {SETTLED_MIN:.0f} to the last")
    return int(growth > MAX_GROWTH)


if __name__ == "__main__":
    sys.exit(main())
