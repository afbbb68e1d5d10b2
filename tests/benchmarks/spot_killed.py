"""Benchmark: how far a robot walks on after the client's process is killed, and which network hiccups it rides out.

`python tests/benchmarks/spot_killed.py [--runs N] [-- OPTIONS OF lios spot run]`: real runs on a simulated Spot in
real time, over TCP. In the first N, the client's process is killed (SIGKILL) while the robot walks. Then, in N runs
each, the robot answers nothing for a while, as in a hiccup of the Wi-Fi, and the walk goes on or the robot stands
still.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from recorders.spot.client.time_source import RunningClock
from recorders.spot.simulated.body import WalkState
from recorders.spot.simulated.services.server import SimulatedSpot
from workbench.worlds.sites.configurations import pick_configuration, site_and_house
from workbench.worlds.sites.site import load_site

LIOS = [sys.executable, "-c", "import sys; from workbench.cli import run; sys.exit(run(sys.argv[1:]))"]
HICCUPS_S = (0.2, 0.4, 0.6, 1.0)
WALKED_M = 0.3
"""How far the robot has walked when something happens to it."""
LIMIT_S = 120.0


@contextmanager
def walking_run(folder: Path, options: Sequence[str] = ()) -> Iterator[tuple[SimulatedSpot, subprocess.Popen[str]]]:
    """A `lios spot run` in a process of its own, whose robot has begun to walk."""
    home = load_site("paper_home")
    site, house = site_and_house(home, pick_configuration(home, "A"))
    with SimulatedSpot(site, house, clock=RunningClock()) as robot:
        there = robot.options(robot.write_certificate(folder / "robot.pem"))
        how = ["--strategy", "pes-greedy", "--estimator", "counts", "--own-estop", "--furniture-open"]
        process = subprocess.Popen(
            [
                *LIOS,
                "spot",
                "run",
                *there,
                *how,
                "--images-hz",
                "0",
                *options,
                "--force",
                "-o",
                str(folder / "k.mcap"),
            ],
            env={**os.environ, "BOSDYN_CLIENT_USERNAME": "user", "BOSDYN_CLIENT_PASSWORD": "simulated"},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            until = time.monotonic() + LIMIT_S
            while robot.state.body.walked_m < WALKED_M:
                if process.poll() is not None or time.monotonic() > until:
                    process.kill()
                    raise RuntimeError(f"the run did not begin: {process.communicate()[1]}")
                time.sleep(0.02)
            yield robot, process
        finally:
            process.kill()
            process.communicate()


def metres_after_kill(folder: Path, options: Sequence[str] = ()) -> float:
    """Kill the process while its robot walks; how far the robot walks on, in metres."""
    with walking_run(folder, options) as (robot, process):
        with robot.state.alive() as state:
            process.kill()
            before_m = state.body.walked_m
        process.wait()
        until = time.monotonic() + LIMIT_S
        while True:
            with robot.state.alive() as state:
                if state.body.walk is None or state.body.walk.state is not WalkState.WALKING:
                    return state.body.walked_m - before_m
            if time.monotonic() > until:
                raise RuntimeError("the robot walks on and on")
            time.sleep(0.05)


def walks_on(folder: Path, hiccup_s: float, options: Sequence[str] = ()) -> bool:
    """Whether the robot walks on through a time in which it answers nothing."""
    with walking_run(folder, options) as (robot, _), robot.state.alive() as state:
        walk = state.body.walk
        time.sleep(hiccup_s)
        state.catch_up()
        return walk is not None and walk.state is WalkState.WALKING


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("options", nargs="*", help="Options of lios spot run, after --.")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lios-killed-") as scratch:
        far = [metres_after_kill(Path(scratch), given.options) for _ in range(given.runs)]
        print(f"walked on after SIGKILL, m: {', '.join(f'{m:.2f}' for m in far)}; at most {max(far, default=0):.2f}")
        for hiccup_s in HICCUPS_S:
            on = sum(walks_on(Path(scratch), hiccup_s, given.options) for _ in range(given.runs))
            print(f"hiccup of {hiccup_s:g} s: walks on in {on} of {given.runs}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
