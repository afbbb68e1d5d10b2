"""Plays logs to viewers: keeps the clock, shows what has passed, and does what viewers ask for."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, final

from recorders.foxglove.live_server import LiveServer, ServedAt
from replayers.mcap_io.scan import Damage
from replayers.serving.playback_clock import MAX_SPEED, MIN_SPEED, PlaybackClock
from replayers.serving.played_logs import PlayedLogs
from workbench.errors import NotFound
from workbench.terminal import say

if TYPE_CHECKING:
    from foxglove.websocket import PlaybackControlRequest, PlaybackState

STEP_S = 0.02


class NothingToServe(NotFound):
    """The logs hold no messages."""

    def __init__(self, paths: Sequence[Path]) -> None:
        super().__init__(f"{' '.join(map(str, paths))}: no messages to show.")


@final
class Player:
    """Serves logs until it is closed; its own thread plays them.

    Args:
        paused: wait for a viewer to press play; otherwise playing starts when the first viewer subscribes, as many
            viewers have no controls for it.

    Raises:
        NothingToServe, NoIndex and the errors of reading a log; BadValue: the speed; MissingExtra, CannotServe.
    """

    def __init__(
        self, paths: Sequence[Path], at: ServedAt, *, speed: float = 1.0, loop: bool = False, paused: bool = False
    ) -> None:
        self._logs = PlayedLogs(paths, on_damage=self._tell_damage)
        self._damaged: set[Path] = set()
        start, end = self._logs.start_ns, self._logs.end_ns
        try:
            if not any(True for _ in self._logs.channels()):
                raise NothingToServe(paths)
            self._clock = PlaybackClock(start, end, start, speed=speed, loop=loop)
            self._lock = threading.Lock()
            self._jumped = True
            self._waits_for_viewer = not paused
            self._stop = threading.Event()
            self.server = LiveServer(
                " ".join(path.name for path in paths),
                at,
                playback_ns=(start, end),
                on_control=self._control,
                on_subscribe=self._subscribed,
            )
        except BaseException:
            self._logs.__exit__(None, None, None)
            raise
        for channel in self._logs.channels():
            self.server.declare(channel)
        self._thread = threading.Thread(target=self._play, name="lios-player", daemon=True)
        self._thread.start()

    @property
    def now_ns(self) -> int:
        """The log time that is shown, in nanoseconds since the epoch."""
        with self._lock:
            return self._clock.now_ns

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.server.close()
        self._logs.__exit__(None, None, None)

    def _subscribed(self) -> None:
        """A new viewer sees how everything stands now, and starts the playing if it is the first."""
        with self._lock:
            self._jumped = True
            if self._waits_for_viewer:
                self._waits_for_viewer = False
                self._clock.play()

    def _control(self, request: PlaybackControlRequest) -> PlaybackState | None:
        from foxglove.websocket import PlaybackCommand

        with self._lock:
            self._waits_for_viewer = False
            self._clock.set_speed(min(max(request.playback_speed or 1.0, MIN_SPEED), MAX_SPEED))
            jumped = request.seek_time is not None
            if request.seek_time is not None:
                self._clock.seek(request.seek_time)
            if request.playback_command == PlaybackCommand.Play:
                jumped = self._clock.play() or jumped
            else:
                self._clock.pause()
            self._jumped = self._jumped or jumped
            return self._state(did_seek=jumped, request_id=request.request_id)

    def _state(self, *, did_seek: bool = False, request_id: str | None = None) -> PlaybackState:
        from foxglove.websocket import PlaybackState, PlaybackStatus

        clock = self._clock
        status = PlaybackStatus.Playing if clock.playing else PlaybackStatus.Paused
        return PlaybackState(
            PlaybackStatus.Ended if clock.ended else status, clock.now_ns, clock.speed, did_seek, request_id
        )

    def _play(self) -> None:
        before = time.monotonic()
        while not self._stop.wait(STEP_S):
            now = time.monotonic()
            self._step(now - before)
            before = now

    def _step(self, elapsed_s: float) -> None:
        with self._lock:
            jumped, self._jumped = self._jumped, False
            stands_ns = self._clock.now_ns
            span = self._clock.advance(elapsed_s)
            now_ns, ended = self._clock.now_ns, span is not None and not self._clock.playing
            if ended and self._clock.loop:
                self._clock.play()
                self._jumped = True
            state = self._state(did_seek=jumped) if ended or jumped else None
        shown = self._logs.standing_at(stands_ns) if jumped else []
        if span is not None:
            shown += self._logs.between(span.after_ns, span.until_ns)
        for channel, data, log_time in shown:
            self.server.publish(channel, data, log_time=log_time)
        if jumped or span is not None:
            self.server.broadcast_time(now_ns)
        if state is not None:
            self.server.broadcast_playback(state)

    def _tell_damage(self, path: Path, damage: Damage) -> None:
        if path not in self._damaged:
            self._damaged.add(path)
            say(f"{path}: damaged, not all of it is shown ({damage.what}). lios doctor {path} lists it all.")
