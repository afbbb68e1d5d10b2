"""A command in a terminal of its own, for tests that type into it and read what it shows."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self

PATIENCE_S = 120.0
COLOURS = re.compile(r"\x1b\[[0-9;]*m")


class TerminalSession:
    """A running command whose input and outputs are one terminal of 100 columns."""

    def __init__(self, words: Sequence[str], *, folder: Path, env: dict[str, str]) -> None:
        self._terminal, far = pty.openpty()
        self._process = subprocess.Popen(
            list(words),
            cwd=folder,
            env=env | {"COLUMNS": "100", "TERM": "dumb"},
            stdin=far,
            stdout=far,
            stderr=far,
            start_new_session=True,
        )
        os.close(far)
        self._shown = ""

    def read_until(self, text: str) -> str:
        """What is shown up to that text, and since the last call; fails if it does not come."""
        until = time.monotonic() + PATIENCE_S
        while text not in self._shown:
            assert time.monotonic() < until, f"{text!r} is not shown, but: {self._shown}"
            assert self._read(), f"{text!r} is not shown before the end, but: {self._shown}"
        before, _, self._shown = self._shown.partition(text)
        return before + text

    def type(self, text: str) -> None:
        os.write(self._terminal, text.encode())

    def end(self) -> tuple[int, str]:
        """The exit code, and what is shown until the end, without colours."""
        while self._read():
            pass
        return self._process.wait(PATIENCE_S), COLOURS.sub("", self._shown)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        os.close(self._terminal)

    def _read(self) -> bool:
        """Reads what is there, or waits for more; whether there can be more."""
        ready, _, _ = select.select([self._terminal], [], [], PATIENCE_S)
        try:
            more = os.read(self._terminal, 65536) if ready else b""
        except OSError:  # on Linux the end of a terminal whose other side is closed
            return False
        self._shown += more.decode(errors="replace").replace("\r\n", "\n")
        return bool(more)
