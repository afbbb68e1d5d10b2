"""Who helps the robot? An operator at the keyboard: confirms, notes, and stops the run by a key.

Keys during a run: space or s stops; n writes a note; ? shows the keys. Without a terminal nobody is there.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Protocol, Self, final

STOP_KEYS = (" ", "s", "\x03")


class Operator(Protocol):
    """Answers questions about the world that the robot cannot settle."""

    def confirm(self, question: str) -> bool: ...


@final
class Nobody:
    """No operator: every question is answered no."""

    def confirm(self, question: str) -> bool:
        return False


@final
class Agreeing:
    """Answers yes, and remembers what was asked: for simulations and tests."""

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


class KeyBoard:
    """Reads single keys in a thread while a run goes on; a context manager, and an Operator.

    Args:
        stop: what the stop key presses.
        on_key: called for any other key outside a question.
    """

    def __init__(self, stop: StopSwitch, on_key: Callable[[str], None] | None = None) -> None:
        self._stop, self._on_key = stop, on_key
        self._asked = threading.Event()
        self._answered = threading.Event()
        self._answer = False
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._saved: object | None = None

    def __enter__(self) -> Self:
        if sys.stdin.isatty():
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
        if self._saved is not None:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._saved)  # type: ignore[arg-type]
            self._saved = None

    def confirm(self, question: str) -> bool:
        """Asks; y is yes, n is no, the stop key stops the run."""
        if self._thread is None:
            return False
        sys.stderr.write(f"{question} [y/n] ")
        sys.stderr.flush()
        self._answered.clear()
        self._asked.set()
        while not self._answered.wait(0.1):
            if self._stop.is_pressed:
                return False
        self._asked.clear()
        sys.stderr.write("\n")
        return self._answer

    def press(self, key: str) -> None:
        """What a key does."""
        if key in STOP_KEYS:
            self._stop.press("stopped by key")
        elif self._asked.is_set():
            if key in "yYnN":
                self._answer = key in "yY"
                self._answered.set()
        elif self._on_key is not None:
            self._on_key(key)

    def _read(self) -> None:
        import select

        while not self._closing.is_set():
            ready, _, _ = select.select([sys.stdin], [], [], 0.1)
            if ready:
                self.press(sys.stdin.read(1))
