"""Follows logs while they are recorded: a log is read again whenever it has grown, and the views move on.

Only what was added is read; the wait before the next reading is a multiple of how long the last one took.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Event, Thread

from dashboards.library.library import Library
from dashboards.viser_app.session import BrowserSession
from dashboards.viser_app.view_errors import ViewErrors
from workbench.errors import LiosError

EVERY_S = 0.5
REST = 4.0
"""The wait before the next reading, as a multiple of the last duration."""


class Follower:
    """Watches the logs of a library until it is stopped."""

    def __init__(self, library: Library, sessions: Callable[[], Sequence[BrowserSession]]) -> None:
        self._library = library
        self._sessions = sessions
        self._stopped = Event()
        self._trouble = ViewErrors("of what is being recorded")
        self._sizes = [_size(path) for path in library.paths]
        self._thread = Thread(target=self._watch, name="follow", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._stopped.set()
        self._thread.join(timeout=5)

    def _watch(self) -> None:
        rest_s = EVERY_S
        while not self._stopped.wait(rest_s):
            began = time.monotonic()
            with self._trouble.caught("the run being recorded", lambda _: None):
                if self._read_what_grew():
                    for session in self._sessions():
                        session.reread()
            rest_s = max(EVERY_S, REST * (time.monotonic() - began))

    def _read_what_grew(self) -> bool:
        grew = False
        for index, before in enumerate(self._sizes):
            size = _size(self._library.paths[index])
            if size == before:
                continue
            self._sizes[index] = size
            try:
                self._library.read_growth(index)
            except LiosError:
                continue  # A record is only partly on disk; the next reading will find the rest.
            grew = True
        return grew


def wait_for(path: Path, *, patience_s: float) -> bool:
    """Waits until a log exists and can be read; False on timeout."""
    from replayers.runs.run import read

    until = time.monotonic() + patience_s
    while time.monotonic() < until:
        if path.exists():
            try:
                read(path)
            except LiosError:
                pass
            else:
                return True
        time.sleep(EVERY_S / 2)
    return False


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0
