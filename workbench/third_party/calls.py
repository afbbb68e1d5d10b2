"""Calls of third-party code in this process: prints redirected, time limited, exceptions as text."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, redirect_stdout
from types import FrameType
from typing import Any

MAX_TIME_LIMIT_S = 86_400.0


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

    The limit interrupts Python code in the main thread only; in other threads (a Dask worker) there is none.
    """
    with redirect_stdout(sys.stderr), _time_limit(limit_s):
        yield


@contextmanager
def _time_limit(seconds: float) -> Generator[None]:
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise TimeLimitReached

    before: Callable[[int, FrameType | None], Any] | int | None = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, min(max(seconds, 0.001), MAX_TIME_LIMIT_S))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
