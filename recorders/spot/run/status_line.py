"""A line at the bottom of the terminal that is renewed in place while other messages scroll above it."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TextIO, final

from rich.cells import cell_len, set_cell_size

from recorders.spot.session.live_status import status_words
from recorders.spot.session.topics import SessionStatus

UNKNOWN_COLUMNS = 80
"""The width assumed if the terminal does not report it."""
CLEAR_LINE = "\r\x1b[2K"


@final
class StatusLine:
    """Stands in for a terminal's stream: whatever is written appears above the line.

    While a line is not ended, such as a question or a note that is being typed, the status is not shown.
    """

    def __init__(self, stream: TextIO, columns: Callable[[], int]) -> None:
        self._stream, self._columns = stream, columns
        self._lock = threading.RLock()
        self._status, self._shown, self._at_start = "", False, True

    def write(self, text: str) -> int:
        if not text:
            return 0
        with self._lock:
            self._hide()
            self._stream.write(text)
            self._at_start = text.endswith("\n")
            self._draw()
        return len(text)

    def show(self, status: SessionStatus) -> None:
        """Renew the line."""
        with self._lock:
            self._hide()
            self._status = status_words(status)
            self._draw()
            self._stream.flush()

    def close(self) -> None:
        """Take the line away."""
        with self._lock:
            self._hide()
            self._status = ""
            self._stream.flush()

    def flush(self) -> None:
        self._stream.flush()

    def isatty(self) -> bool:
        return self._stream.isatty()

    def fileno(self) -> int:
        return self._stream.fileno()

    @property
    def encoding(self) -> str:
        return self._stream.encoding

    def _hide(self) -> None:
        if self._shown:
            self._stream.write(CLEAR_LINE)
            self._shown = False

    def _draw(self) -> None:
        if self._status and self._at_start:
            width = (self._columns() or UNKNOWN_COLUMNS) - 1
            self._stream.write(set_cell_size(self._status, min(width, cell_len(self._status))))
            self._shown = True


@contextmanager
def status_line() -> Generator[Callable[[SessionStatus], None] | None]:
    """Meanwhile standard error has a status line, where it is a terminal; yields what renews it."""
    stream = sys.stderr
    if not stream.isatty() or os.environ.get("TERM") == "dumb":
        yield None
        return
    line = StatusLine(stream, lambda: os.get_terminal_size(stream.fileno()).columns)
    sys.stderr = line  # pyright: ignore[reportAttributeAccessIssue] (a stream as far as anything here writes to one)
    try:
        yield line.show
    finally:
        line.close()
        sys.stderr = stream
