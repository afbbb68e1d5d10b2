"""Who helps the robot? An operator at the keyboard: confirms, notes, ends a session, and stops a run by a key.

During a run space or s stops, at any moment. Where no robot is driven from here (a recording) a key may open a line:
what is typed until Enter is handed over; Esc drops it. Keys are read in a thread of their own, so that nothing waits
for a typist. Without a terminal nobody is there.
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
"""What arrow and function keys send."""
LINE_CHARS = 2000
"""A longer note is cut: a cat on the keyboard."""


class Operator(Protocol):
    """Answers questions about the world that the robot cannot settle.

    Attributes:
        present: whether there is anybody to answer; where there is not, what a person would do counts as done.
    """

    @property
    def present(self) -> bool: ...

    def confirm(self, question: str) -> bool: ...


@final
class Nobody:
    """No operator: every question is answered no."""

    present = False

    def confirm(self, question: str) -> bool:
        return False


@final
class Agreeing:
    """Answers yes, and remembers what was asked: for simulations and tests."""

    present = True

    def __init__(self) -> None:
        self.asked: list[str] = []

    def confirm(self, question: str) -> bool:
        self.asked.append(question)
        return True


@final
class StopSwitch:
    """Set by a key, a signal or a test; whoever waits for the robot looks at it."""

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
    """A line that is being typed."""

    then: Callable[[str], None]
    text: str = ""


class KeyBoard:
    """Reads keys in a thread while a run or a recording goes on; a context manager, and an Operator.

    Args:
        stop: what the stop keys press.
        on_key: called for any other key outside a question and a line.
        stop_keys: keys that stop at once.
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
        """Asks; y is yes, n is no, the stop key stops the run."""
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
        """What is typed from now on is a line; `then` gets it when Enter is pressed or the session ends."""
        self._line = _Line(then)
        _show(prompt)

    def press(self, key: str) -> None:
        """What a key does."""
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
        """Takes bytes as they come: the text layer of stdin would keep back what was typed ahead."""
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
def signals_press(stop: StopSwitch) -> Generator[None]:
    """Ctrl-C, SIGTERM and a closed terminal press the stop instead of breaking off what must end well."""
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
    """Whether keys can be read; a job in the background of a shell would be stopped for trying."""
    if not sys.stdin.isatty():
        return False
    try:
        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except OSError:
        return False


def _show(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()
