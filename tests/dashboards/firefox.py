"""A Firefox for tests, driven by its own Marionette protocol, since Playwright drives only its own Firefox build.

Firefox gives no WebGL without a screen, so Xvfb is one where there is none (Debian: firefox-esr, xvfb).
A message is LENGTH:JSON over TCP; a command is [0, id, name, parameters], its answer [1, id, error, result].
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

PREFERENCES = {
    "marionette.port": 0,
    "webgl.force-enabled": True,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.enabled": False,
    "network.captive-portal-service.enabled": False,
    "app.update.enabled": False,
}


class Firefox:
    """One tab."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=120)
        self._count = 0
        self._read()
        self.ask("WebDriver:NewSession", {"acceptInsecureCerts": True})

    def ask(self, name: str, parameters: dict[str, Any] | None = None) -> Any:
        self._count += 1
        data = json.dumps([0, self._count, name, parameters or {}]).encode()
        self._socket.sendall(str(len(data)).encode() + b":" + data)
        _, _, error, result = self._read()
        assert error is None, error
        return result

    def goto(self, url: str) -> None:
        self.ask("WebDriver:Navigate", {"url": url})

    def evaluate(self, expression: str) -> Any:
        return self.ask("WebDriver:ExecuteScript", {"script": f"return {expression};", "args": []})["value"]

    def click(self, xpath: str) -> None:
        """A click of a mouse, as a person makes it."""
        found = self.ask("WebDriver:FindElement", {"using": "xpath", "value": xpath})["value"]
        self.ask("WebDriver:ElementClick", {"id": next(iter(found.values()))})

    def until(self, expression: str, *, seconds: float = 90) -> None:
        end = time.monotonic() + seconds
        while not self.evaluate(expression):
            assert time.monotonic() < end, f"still not: {expression}"
            time.sleep(0.1)

    def screenshot(self) -> bytes:
        answer = self.ask("WebDriver:TakeScreenshot", {"full": False, "hash": False})
        return base64.b64decode(answer["value"])

    def _read(self) -> Any:
        head = b""
        while not head.endswith(b":"):
            part = self._socket.recv(1)
            assert part, "Firefox has gone"
            head += part
        left, parts = int(head[:-1]), []
        while left:
            parts.append(self._socket.recv(min(left, 1 << 16)))
            assert parts[-1], "Firefox has gone"
            left -= len(parts[-1])
        return json.loads(b"".join(parts))


@contextmanager
def firefox(*, width: int = 1200, height: int = 760) -> Iterator[Firefox]:
    """A running browser; skips where there is none."""
    path = os.environ.get("LIOS_FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")
    if path is None:
        pytest.skip("no Firefox here; install it (apt-get install firefox-esr) or name it in LIOS_FIREFOX")
    with _screen(width, height) as display, tempfile.TemporaryDirectory(prefix="lios-firefox-") as profile:
        lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in PREFERENCES.items()]
        (Path(profile) / "user.js").write_text("\n".join(lines), encoding="utf-8")
        started = subprocess.Popen(
            [path, "--marionette", "--no-remote", "--profile", profile, f"--width={width}", f"--height={height}"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"LIBGL_ALWAYS_SOFTWARE": "1", "DISPLAY": display},
        )
        try:
            tab = Firefox(_port(Path(profile), started))
            with closing(tab._socket):
                tab.ask("WebDriver:SetWindowRect", {"width": width, "height": height})
                yield tab
        finally:
            _end(started)


@contextmanager
def _screen(width: int, height: int) -> Iterator[str]:
    """The display that is there, or one in memory."""
    if os.environ.get("DISPLAY"):
        yield os.environ["DISPLAY"]
        return
    if shutil.which("Xvfb") is None:
        pytest.skip("no display and no Xvfb here; install it (apt-get install xvfb)")
    read, write = os.pipe()
    size = f"{width + 40}x{height + 200}x24"
    started = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", size, "-nolisten", "tcp"],
        pass_fds=[write],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    try:
        with os.fdopen(read) as answer:
            yield f":{answer.readline().strip()}"
    finally:
        _end(started)


def _end(started: subprocess.Popen[bytes]) -> None:
    started.terminate()
    try:
        started.wait(timeout=20)
    except subprocess.TimeoutExpired:
        started.kill()
        started.wait()


def _port(profile: Path, started: subprocess.Popen[bytes]) -> int:
    """Where it listens; it writes the port that it took into its profile."""
    end = time.monotonic() + 90
    while time.monotonic() < end:
        assert started.poll() is None, "Firefox did not start"
        file = profile / "MarionetteActivePort"
        if file.exists() and file.read_text().strip():
            return int(file.read_text())
        time.sleep(0.1)
    raise AssertionError("Firefox does not listen")
