"""Third-party code that will not stop: neither its time limit nor Ctrl-C waits for it for ever."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.planning.strategies import StrategyNotLoaded, strategy
from workbench.plugins import NameOrigin

SWALLOWS = """
import sys, time
from workbench.third_party import calls
calls.AGAIN_S = 0.1
with calls.redirected_and_timed({limit}):
    began = False
    while True:
        try:
            if not began:
                began = True
                print("began", file=sys.stderr, flush=True)
            time.sleep(0.05)
        except BaseException:
            pass
"""


CLEANS_UP = """
import sys, time
from workbench.third_party import calls
calls.AGAIN_S, calls.CLEAN_UP_S = 0.05, {clean_up_s}
try:
    with calls.redirected_and_timed(0.05):
        try:
            time.sleep(60)
        finally:
            for _ in range(20):
                try:
                    time.sleep(0.05)
                    raise OSError
                except OSError:
                    time.sleep(0.01)
            print("cleaned up", file=sys.stderr)
except calls.TimeLimitReached:
    print("stopped", file=sys.stderr)
"""


def started(limit: float) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-c", SWALLOWS.format(limit=limit)], stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize(
    ("clean_up_s", "said"),
    [
        (30.0, ["cleaned up", "stopped"]),
        (0.3, ["lios: third-party code does not stop at its time limit of 0.05 s: the command is ended"]),
    ],
)
def test_code_that_cleans_up_is_left_to_it_for_a_while(clean_up_s: float, said: list[str]) -> None:
    code = CLEANS_UP.format(clean_up_s=clean_up_s)
    done = subprocess.run([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, check=False, timeout=60)
    assert done.stderr.splitlines() == said


def test_a_time_limit_that_is_swallowed_ends_the_command() -> None:
    with started(0.2) as process:
        told = process.communicate(timeout=60)[1]
    assert process.returncode == 1
    assert told.splitlines() == [
        "began",
        "lios: third-party code does not stop at its time limit of 0.2 s: the command is ended",
    ]


def test_a_second_ctrl_c_ends_a_command_whose_code_swallows_the_first() -> None:
    with started(600.0) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "began\n"
        while process.poll() is None:
            process.send_signal(signal.SIGINT)
            time.sleep(0.2)
        assert process.returncode == 1
        assert process.stderr.read() == "lios: Stopped: third-party code would not.\n"


def test_a_planner_that_does_not_load_in_time_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "loads_for_ever.py").write_text(
        "import time\n\nclass Planner:\n    def __init__(self): time.sleep(600)\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("workbench.planning.strategies.LOADING_S", 0.2)
    with pytest.raises(StrategyNotLoaded, match="it was not loaded within"):
        strategy("loads_for_ever:Planner", origin=NameOrigin.USER)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
