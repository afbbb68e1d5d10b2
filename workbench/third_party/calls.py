"""Calls of third-party code in this process: prints redirected, time limited, exceptions as text.

Code with a bare `except` in a loop swallows both the time limit and Ctrl-C. Then neither is raised only once, and
where the code still goes on, the command ends without it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, redirect_stdout
from types import FrameType
from typing import Any, NoReturn

MAX_TIME_LIMIT_S = 86_400.0
LOADING_S = 60.0
"""Importing third-party code may import much."""
AGAIN_S, MAX_SWALLOWED = 1.0, 5
"""A time limit that was swallowed is raised again after so long, so often; after that the command ends."""
CLEAN_UP_S = 30.0
"""How long code may take to clean up once its time is up."""


class TimeLimitReached(BaseException):
    """Raised in third-party code when its time is up; a BaseException, so that `except Exception` does not catch
    it."""


def exception_text(error: BaseException) -> str:
    """An exception of third-party code as one line of text."""
    return f"it raised {type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")


@contextmanager
def redirected_and_timed(limit_s: float) -> Generator[None]:
    """Redirect prints to standard error, since standard output carries the command's result, and raise
    TimeLimitReached when the time is up.

    The limit interrupts Python code in the main thread only; in other threads (a Dask worker) there is none. Code
    that goes on after five of them, or cleans up for more than half a minute, ends the command with exit code 1, and
    code that goes on after Ctrl-C does at the next one. What a log holds until then stays, as after a kill.
    """
    with redirect_stdout(sys.stderr), _time_limit(limit_s), _ctrl_c_once():
        yield


@contextmanager
def _time_limit(seconds: float) -> Generator[None]:
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    swallowed, cleaned_s = 0, 0.0

    def stop(_number: int, _frame: FrameType | None) -> None:
        nonlocal swallowed, cleaned_s
        cleans_up = _is_being_handled(TimeLimitReached)
        if (cleans_up and cleaned_s >= CLEAN_UP_S) or (not cleans_up and swallowed == MAX_SWALLOWED):
            _end(f"third-party code does not stop at its time limit of {seconds:g} s: the command is ended")
        if cleans_up:
            cleaned_s += AGAIN_S
            return
        swallowed += 1
        raise TimeLimitReached

    before: Callable[[int, FrameType | None], Any] | int | None = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, min(max(seconds, 0.001), MAX_TIME_LIMIT_S), AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _is_being_handled(kind: type[BaseException]) -> bool:
    """Whether the code that runs is in an `except` or `finally` that such an exception led to."""
    error = sys.exc_info()[1]
    while error is not None and not isinstance(error, kind):
        error = error.__context__
    return error is not None


@contextmanager
def _ctrl_c_once() -> Generator[None]:
    """The first Ctrl-C raises KeyboardInterrupt, as ever; the next one while the same code runs ends the command."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is not signal.default_int_handler:
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, lambda _number, _frame: _end("Stopped: third-party code would not."))
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _end(why: str) -> NoReturn:
    """Ends the process without asking the code that runs in it."""
    os.write(2, f"lios: {why}\n".encode())
    os._exit(1)
