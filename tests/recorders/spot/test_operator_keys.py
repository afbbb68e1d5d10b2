"""Notes and the outcome by key, at a real terminal (a pseudo-terminal), while the robot is being recorded."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
from spot_help import messages, placed

from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.operator import KeyboardOperator, StopSwitch
from recorders.spot.session.topics import Note
from recorders.spot.simulated.services.server import SimulatedSpot
from replayers.log_tools.notes import notes_of
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.execution.events import RunStatus

LIOS = [sys.executable, "-c", "import sys; from workbench.cli import run; sys.exit(run(sys.argv[1:]))"]


class Terminal:
    """A command at a terminal of its own: what it shows is read, keys are typed."""

    def __init__(self, arguments: list[str], environment: dict[str, str]) -> None:
        self.shown = ""
        self.pid, self._ends = pty.fork()
        if self.pid == 0:
            os.execve(LIOS[0], [*LIOS, *arguments], environment)

    def wait_for(self, words: str, timeout_s: float = 60.0) -> None:
        end = time.monotonic() + timeout_s
        while words not in self.shown and time.monotonic() < end:
            self._listen(0.1)
        assert words in self.shown, self.shown

    def type(self, text: str, *, every_s: float = 0.0) -> None:
        for key in text if every_s else [text]:
            os.write(self._ends, key.encode())
            self._listen(every_s)

    def result(self, timeout_s: float = 60.0) -> int:
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            self._listen(0.1)
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                os.close(self._ends)
                return os.waitstatus_to_exitcode(status)
        raise TimeoutError(self.shown)

    def _listen(self, seconds: float) -> None:
        ready, _, _ = select.select([self._ends], [], [], seconds)
        if ready:
            try:
                self.shown += os.read(self._ends, 65536).decode(errors="replace")
            except OSError:
                time.sleep(seconds)


@contextmanager
def terminal(*arguments: str, folder: Path, speed_up: float = 1.0) -> Iterator[tuple[Terminal, SimulatedSpot]]:
    site, house = placed()
    with SimulatedSpot(site, house, clock=RunningClock(speed_up=speed_up)) as spot:
        certificate = spot.write_certificate(folder / "robot.pem")
        environment = {
            **os.environ,
            "BOSDYN_CLIENT_USERNAME": "user",
            "BOSDYN_CLIENT_PASSWORD": "simulated",
            "NO_COLOR": "1",
        }
        window = Terminal([*arguments, *spot.options(certificate)], environment)
        try:
            yield window, spot
        finally:
            try:
                os.kill(window.pid, signal.SIGKILL)
                os.waitpid(window.pid, 0)
            except (ProcessLookupError, ChildProcessError):
                pass


def is_walking(spot: SimulatedSpot) -> bool:
    with spot.state.alive() as state:
        return state.body.walk is not None and state.body.walk.state == "walking"


@pytest.mark.ci
def test_a_note_is_typed_while_everything_is_recorded(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    with terminal("spot", "record", "-o", str(log), "--images-hz", "0", folder=tmp_path) as (window, _spot):
        window.wait_for("Recording")
        time.sleep(1.0)
        began_ns = time.time_ns()
        window.type("n")
        window.wait_for("Note (")
        prompted_ns = time.time_ns()
        time.sleep(1.0)
        window.type("die Türx\x7f war q f d", every_s=0.1)
        window.type("\r")
        window.wait_for("Noted: die Tür war q f d")
        noted_ns = time.time_ns()
        window.type("\x1b[A")  # an arrow key is no note and no end
        window.type("n")
        window.type("never mind")
        window.type("\x1b")
        window.wait_for("(dropped)")
        window.type("m")
        window.wait_for("Noted: mark")
        window.type("f")
        assert window.result() == 0, window.shown
    noted = [msgspec.json.decode(data, type=Note) for *_, data in messages(log, "/session/note")]
    assert [note.text for note in noted] == ["die Tür war q f d", "mark"]
    at_ns = noted[0].stamp.ns
    assert began_ns - 1e8 < at_ns < prompted_ns + 1e8, "a note is about the moment at which n was pressed"
    assert [(note.text, note.author) for note in notes_of(log)] == [
        ("die Tür war q f d", "operator"),
        ("mark", "operator"),
    ]
    run = read(log)
    assert run.outcome is not None
    assert run.outcome.status == RunStatus.ABORTED
    assert run.outcome.reason == "the operator says that it failed"
    stamps = sorted(log_time for _, log_time, _, _ in messages(log, "/spot/robot_state"))
    assert sum(prompted_ns < at < noted_ns for at in stamps) >= 5, "typing holds nothing up"


@pytest.mark.slow
def test_ctrl_c_twice_still_closes_the_log_and_keeps_the_half_typed_note(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    with terminal("spot", "record", "-o", str(log), "--images-hz", "0", folder=tmp_path) as (window, _spot):
        window.wait_for("Recording")
        time.sleep(0.8)
        window.type("n")
        window.wait_for("Note (")
        window.type("half a no")
        time.sleep(0.3)
        window.type("\x03")
        window.type("\x03")
        assert window.result() == 0, window.shown
    assert read(log).complete
    assert [note.text for note in notes_of(log)] == ["half a no"]


@pytest.mark.slow
def test_a_closed_terminal_ends_a_run_well(tmp_path: Path) -> None:
    """The laptop's lid, the ssh session: the robot stops, the lease is returned, the log is whole."""
    log = tmp_path / "run.mcap"
    arguments = ["spot", "run", "-o", str(log), "--estimator", "counts", "--own-estop", "--images-hz", "0"]
    arguments += ["--stop-within", "2"]
    with terminal(*arguments, folder=tmp_path, speed_up=2) as (window, spot):
        window.wait_for("Plan 1")
        window.type("n")
        time.sleep(1.0)
        os.kill(window.pid, signal.SIGHUP)
        assert window.result() == 0, window.shown
        assert spot.state.leases.owner is None
        assert spot.state.body.walk is None or spot.state.body.walk.state != "walking"
    run = read(log)
    assert run.complete
    assert run.outcome is not None
    assert run.outcome.status == RunStatus.ABORTED
    assert run.outcome.reason == "stopped: the terminal was closed"
    assert [note.text for note in notes_of(log)] == ["mark"]


@pytest.mark.parametrize("key", [" ", pytest.param("s", marks=pytest.mark.slow)])
def test_the_stop_key_stops_a_run_at_the_terminal(
    key: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "run.mcap"
    arguments = ["spot", "run", "-o", str(log), "--estimator", "counts", "--own-estop", "--images-hz", "0"]
    arguments += ["--stop-within", "2"]
    with terminal(*arguments, folder=tmp_path) as (window, spot):
        window.wait_for("Plan 1")
        until = time.monotonic() + 60
        while not is_walking(spot):
            assert time.monotonic() < until, window.shown
            time.sleep(0.02)
        window.type(key)
        window.wait_for("stopped by key")
        assert window.result() == 0, window.shown
        assert spot.state.leases.owner is None
        walk = spot.state.body.walk
        assert walk is not None
        assert walk.state in ("stopped", "expired"), "on its way to the first container"
    assert re.search(r"aborted", window.shown)
    assert lios(["replay", str(log), "--verify"]) == 0
    assert "the run was stopped: stopped by key" in capsys.readouterr().out


def test_keys_without_a_terminal_do_nothing() -> None:
    stop = StopSwitch()
    with KeyboardOperator(stop) as keys:
        assert not keys.confirm("Is anybody there?")
    assert not stop.is_pressed


def test_a_line_is_bounded_and_can_be_corrected() -> None:
    taken: list[str] = []
    keys = KeyboardOperator(StopSwitch())
    keys.take_line("", taken.append)
    for key in "x" * 5000 + "\x15" + "ok\x7f!\x00" + "\n":
        keys.press(key)
    assert taken == ["o!"]
    keys.take_line("", taken.append)
    for key in "x" * 5000 + "\r":
        keys.press(key)
    assert len(taken[1]) == 2000
