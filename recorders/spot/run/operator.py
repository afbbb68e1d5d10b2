"""The operator at the keyboard: confirms actions, takes notes, ends a session, and stops a run.

During a run, space or s stops the robot at any time. While recording (no robot is driven from here) a key may open
a line of input, finished by Enter or discarded by Esc. Keys are read in a separate thread, so that nothing blocks
on input. Without a terminal there is no operator.
"""

from __future__ import annotations

import codecs
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import FrameType, TracebackType
from typing import Any, Protocol, Self, final

STOP_KEYS = (" ", "s", "\x03")
ENTER, ESCAPE, ERASE, CLEAR, INTERRUPT = "\r\n", "\x1b", "\x7f\b", "\x15", "\x03"
NO_KEY = re.compile(r"\x1b(\[[0-9;]*[A-Za-z~]|O.)")
"""Escape sequences of arrow and function keys."""
LINE_CHARS = 2000
"""Most characters of a note."""


class Operator(Protocol):
    """Answers questions that the robot cannot answer itself.

    Attributes:
        present: whether an operator is present; if not, every question is answered no.
    """

    @property
    def present(self) -> bool: ...

    def confirm(self, question: str) -> bool: ...


@final
class NoOperator:
    """No operator: every question is answered no."""

    present = False

    def confirm(self, question: str) -> bool:
        return False


@final
class AgreeingOperator:
    """Answers yes to everything and keeps the questions; for simulations and tests."""

    present = True

    def __init__(self) -> None:
        self.asked: list[str] = []

    def confirm(self, question: str) -> bool:
        self.asked.append(question)
        return True


@final
class StopSwitch:
    """A stop flag set by a key, a signal or a test, and checked while waiting for the robot."""

    def __init__(self) -> None:
        self._event = threading.Event()
        self.reason = ""

    def press(self, reason: str) -> None:
        if not self._event.is_set():
            self.reason = reason
            self._event.set()

    @property
    def is_pressed(self) -> bool:
        return self._event.is_set()


@dataclass(slots=True)
class _Line:
    """A line of input being typed."""

    then: Callable[[str], None]
    text: str = ""


class KeyboardOperator:
    """Reads keys in a thread during a run or a recording; a context manager and an Operator.

    Args:
        stop: the switch that the stop keys press.
        on_key: called for other keys, outside of questions and lines.
        stop_keys: keys that stop immediately.
    """

    def __init__(
        self,
        stop: StopSwitch,
        on_key: Callable[[str], None] | None = None,
        *,
        stop_keys: tuple[str, ...] = STOP_KEYS,
    ) -> None:
        self._stop, self.on_key, self._stop_keys = stop, on_key, stop_keys
        self._asked = threading.Event()
        self._answered = threading.Event()
        self._answer = False
        self._line: _Line | None = None
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._saved: list[Any] | None = None

    def __enter__(self) -> Self:
        if _at_a_terminal():
            import termios
            import tty

            self._saved = termios.tcgetattr(sys.stdin)
            tty.setcbreak(sys.stdin)
            self._thread = threading.Thread(target=self._read, name="lios-keys", daemon=True)
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
        if self._line is not None:
            self._end_line()
        if self._saved is not None:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._saved)
            self._saved = None

    @property
    def present(self) -> bool:
        return self._thread is not None

    def confirm(self, question: str) -> bool:
        """Ask a yes/no question: y, n, or a stop key, which stops the run."""
        if self._thread is None:
            return False
        _show(f"{question} [y/n] ")
        self._answered.clear()
        self._asked.set()
        try:
            while not self._answered.wait(0.1):
                if self._stop.is_pressed or not self._thread.is_alive():
                    return False
        finally:
            self._asked.clear()
        _show("\n")
        return self._answer

    def take_line(self, prompt: str, then: Callable[[str], None]) -> None:
        """Start a line of input; `then` is called with it after Enter or at the end of the session."""
        self._line = _Line(then)
        _show(prompt)

    def press(self, key: str) -> None:
        """Handle a key."""
        if self._line is not None and key != INTERRUPT:
            self._type(self._line, key)
        elif key in self._stop_keys:
            self._stop.press("stopped by key")
        elif self._asked.is_set():
            if key in "yYnN":
                self._answer = key in "yY"
                self._answered.set()
        elif self.on_key is not None:
            self.on_key(key)

    def _type(self, line: _Line, key: str) -> None:
        if key in ENTER:
            self._end_line()
        elif key == ESCAPE:
            self._line = None
            _show(" (dropped)\n")
        elif key == CLEAR:
            _show("\b \b" * len(line.text))
            line.text = ""
        elif key in ERASE:
            if line.text:
                _show("\b \b")
            line.text = line.text[:-1]
        elif key.isprintable() and len(line.text) < LINE_CHARS:
            line.text += key
            _show(key)

    def _end_line(self) -> None:
        line, self._line = self._line, None
        _show("\n")
        if line is not None:
            line.then(line.text.strip())

    def _read(self) -> None:
        """Read raw bytes: the text layer of stdin would buffer input."""
        import select

        decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
        descriptor = sys.stdin.fileno()
        while not self._closing.is_set():
            ready, _, _ = select.select([descriptor], [], [], 0.1)
            if not ready:
                continue
            data = os.read(descriptor, 4096)
            if not data:
                return  # the terminal is gone
            for key in NO_KEY.sub("", decoder.decode(data)):
                self.press(key)


@contextmanager
def stop_on_signals(stop: StopSwitch) -> Generator[None]:
    """Let Ctrl-C, SIGTERM and a closed terminal press the stop switch, so that the run ends in an orderly way."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    words = {signal.SIGINT: "stopped by Ctrl-C", signal.SIGTERM: "stopped by a signal"}
    if hasattr(signal, "SIGHUP"):
        words[signal.SIGHUP] = "stopped: the terminal was closed"
    before = {number: signal.getsignal(number) for number in words}
    try:
        for number, reason in words.items():
            signal.signal(number, partial(_press, stop, reason))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _press(stop: StopSwitch, reason: str, _number: int, _frame: FrameType | None) -> None:
    stop.press(reason)


def _at_a_terminal() -> bool:
    """Whether keys can be read; a background job of a shell would be suspended if it tried."""
    if not sys.stdin.isatty():
        return False
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:
        return False


def _show(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()
