"""Turns exceptions while a view is drawn into a line in the tab and a line in the server's log.

The thread of a view and the panels of a tab are edges like that of the command line: an exception that escaped would
end the thread and freeze the tab silently. With --debug the traceback follows in the log.
"""

from __future__ import annotations

import logging
import traceback
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import final

from workbench.errors import LiosError

MAX_LINE_CHARS = 300
log = logging.getLogger("lios.dashboard")


@final
class ViewErrors:
    """Errors of one view. The log reports an error once, for as long as it stays the same."""

    def __init__(self, view: str) -> None:
        self._view = view
        self._notified: dict[str, str] = {}

    @contextmanager
    def caught(self, what: str, tell: Callable[[str], None]) -> Generator[None]:
        """Catches what is raised inside the block.

        Args:
            what: what is being drawn ("the plan").
            tell: shows a line in the tab.
        """
        try:
            yield
        except Exception as error:
            line = f"{what} could not be drawn: {one_line(error)}"
            if self._notified.get(what) != line:
                self._notified[what] = line
                log.error("lios: view %s: %s", self._view, line)
                log.debug("the traceback of it:", exc_info=error)
            with suppress(Exception):
                tell(line)
        else:
            self._notified.pop(what, None)


def one_line(error: Exception) -> str:
    """An exception as a line: its message, and for a fault of ours its kind and where it came from."""
    words = " ".join(str(error).split())
    words = words if len(words) <= MAX_LINE_CHARS else words[: MAX_LINE_CHARS - 1] + "…"
    if isinstance(error, LiosError):
        return words
    frames = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {words}".rstrip(": ") + where
