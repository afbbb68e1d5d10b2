"""Tracebacks of code from outside, shown on standard error under `lios --debug`.

Such code runs in worker processes and sandboxes too, which inherit the environment whatever starts them; so `--debug`
sets an environment variable.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Generator
from contextlib import contextmanager, suppress
from types import TracebackType

_VARIABLE = "LIOS_DEBUG"

_shown: set[str] = set()
"""Tracebacks already shown by this process: a planner that breaks does so in every world."""


@contextmanager
def debugging() -> Generator[None]:
    """Meanwhile, this process and those that it starts show tracebacks."""
    before = os.environ.get(_VARIABLE)
    os.environ[_VARIABLE] = "1"
    _shown.clear()
    try:
        yield
    finally:
        os.environ.pop(_VARIABLE, None)
        if before is not None:
            os.environ[_VARIABLE] = before


def show_traceback(error: BaseException) -> None:
    """Show the traceback of an exception of outside code, once, from its own first line on; nothing otherwise."""
    if os.environ.get(_VARIABLE) != "1":
        return
    text = "".join(traceback.format_exception(type(error), error, _from_outside(error.__traceback__))).rstrip()
    if text not in _shown:
        _shown.add(text)
        with suppress(OSError):
            print(text, file=sys.stderr, flush=True)


def _from_outside(frames: TracebackType | None) -> TracebackType | None:
    """The traceback without this project's frames before the first one of other code; whole if there is no such."""
    mine = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    ours = tuple(os.path.join(mine, room, "") for room in ("workbench", "recorders", "replayers", "dashboards"))
    first = frames
    while first is not None and os.path.abspath(first.tb_frame.f_code.co_filename).startswith(ours):
        first = first.tb_next
    return first or frames
