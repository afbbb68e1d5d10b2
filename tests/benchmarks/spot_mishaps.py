"""Benchmark: what goes wrong on a first day, recorded, and what doctor, replay and view say of each log.

`python tests/benchmarks/spot_mishaps.py [-o FOLDER] [MISHAP ...]`: each mishap is a run on a simulated Spot in real
time (its body five times as fast), with outages, a full disk, a killed process, a missed tag, or a dropped item;
together they are about ten minutes of the robot's time. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from dashboards.library.library import Library
from recorders.spot.client.time_source import RunningClock
from recorders.spot.simulated.faults import FaultKind, read_faults
from recorders.spot.simulated.services.server import SimulatedSpot
from replayers.counterfactual.replay import replay
from replayers.runs.run import read
from workbench.cli import run
from workbench.errors import LiosError
from workbench.worlds.sites.configurations import pick_configuration, site_and_house
from workbench.worlds.sites.site import load_site

LIOS = [sys.executable, "-c", "import sys; from workbench.cli import run; sys.exit(run(sys.argv[1:]))"]
SPEED_UP = 5.0
ROOM_BYTES = 800_000
"""Size at which the log's disk is full."""
KILLED_AFTER_S = 12.0
STRATEGIES = ("pes-greedy", "model-lios")
"""The recorded strategy, and one that is replayed over its log."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mishap:
    """A run in which something goes wrong.

    Attributes:
        faults: of the simulated robot. options: of `lios spot run`, beyond those of every run.
        outages_s: seconds from the first decision at which the network is away, for away_s each.
        drops_item: whether the gripper loses what it holds. killed: whether the process is killed.
        full_disk: whether the log's disk is full after ROOM_BYTES.
    """

    faults: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    outages_s: tuple[float, ...] = ()
    away_s: float = 5.0
    drops_item: bool = False
    full_disk: bool = False
    killed: bool = False


MISHAPS = {
    "none": Mishap(),
    "outages": Mishap(outages_s=(2.0, 12.0), away_s=1.5, options=("--resume",)),
    "outage-without-resume": Mishap(outages_s=(2.0,)),
    "full-disk": Mishap(options=("--images-hz", "10"), full_disk=True),
    "killed": Mishap(killed=True),
    "missed-tag": Mishap(faults=("tag-not-seen@0",)),
    "dropped-item": Mishap(drops_item=True),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What was said of a mishap: by the run itself, doctor, replay and the viewer."""

    run: str
    doctor: str
    replay: str
    view: str


def apply_fault(mishap: Mishap, log: Path) -> Told:
    """Record a mishap, and ask about its log."""
    home = load_site("paper_home")
    site, house = site_and_house(home, pick_configuration(home, "A"))
    faults = read_faults(mishap.faults)
    with SimulatedSpot(site, house, clock=RunningClock(speed_up=SPEED_UP), faults=faults) as robot:
        there = robot.options(robot.write_certificate(log.with_suffix(".pem")))
        how = ["--strategy", "pes-greedy", "--estimator", "counts", "--own-estop", "--furniture-open", "--look", "1"]
        how += ["--stop-within", "2"]  # the body is five times as fast, the network is not
        command = [*LIOS, "spot", "run", *there, *how, *mishap.options, "--force", "-o", str(log)]
        login = {"BOSDYN_CLIENT_USERNAME": "user", "BOSDYN_CLIENT_PASSWORD": "simulated"}
        process = subprocess.Popen(
            command,
            env={**os.environ, **login},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=_small_disk if mishap.full_disk else None,
        )
        while process.poll() is None and not log.exists():
            time.sleep(0.1)
        _happen(mishap, robot, process)
        said = process.communicate()[1]
    told = [line for line in said.splitlines() if line.startswith(("Ended", "lios:"))]
    ended = told or [f"killed ({process.returncode})"]
    return Told(
        run="; ".join(ended).replace(f"{log.parent}/", ""),
        doctor=_doctor(log),
        replay=_replayed(log),
        view=_viewed(log),
    )


def _happen(mishap: Mishap, robot: SimulatedSpot, process: subprocess.Popen[str]) -> None:
    """Let the mishap happen to a run that has begun."""
    began = time.monotonic()
    for outage_s in mishap.outages_s:
        time.sleep(max(0.0, outage_s - (time.monotonic() - began)))
        robot.drop(mishap.away_s)
    while mishap.drops_item and process.poll() is None:
        with robot.state.alive() as state:
            if state.held is not None:
                break
        time.sleep(0.2)
    if mishap.drops_item:
        time.sleep(1.0)
        robot.inject(FaultKind.DROPPED_ITEM)
    if mishap.killed:
        time.sleep(KILLED_AFTER_S)
        process.kill()


def _small_disk() -> None:
    """A limit on file sizes, which a write meets as a disk that is full."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM_BYTES, ROOM_BYTES))


def _doctor(log: Path) -> str:
    """The exit code and what doctor says, without the folder."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        code = run(["doctor", str(log)])
    lines = [" ".join(line.split()) for line in out.getvalue().replace(f"{log.parent}/", "").splitlines()]
    return f"{code}: " + "; ".join(line for line in lines if not line.startswith("At most"))


def _replayed(log: Path) -> str:
    """The bounds of two strategies over the log, or why there are none."""
    told: list[str] = []
    for strategy in STRATEGIES:
        try:
            answer = replay(read(log), strategy)
        except LiosError as error:
            return str(error).replace(f"{log.parent}/", "")
        bounds = answer.bounds
        if bounds is None:
            figures = f"{answer.status}: {answer.reason}"
        elif bounds.exact:
            figures = f"exactly {bounds.lower:.2f}"
        else:
            figures = f"{bounds.lower:.2f} to {bounds.upper:.2f}"
        told.append(f"{strategy} {figures}")
    return "; ".join(told)


def _viewed(log: Path) -> str:
    """What the dashboard opens with."""
    try:
        library = Library([log])
        timeline = library.timeline(0)
    except LiosError as error:
        return str(error)
    return f"{len(timeline.decisions)} decisions, {timeline.run.outcome.status if timeline.run.outcome else 'no end'}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mishaps", nargs="*", default=list(MISHAPS))
    parser.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="lios-mishaps-") as scratch:
        folder = given.output or Path(scratch)
        folder.mkdir(exist_ok=True)
        print("| mishap | the run | doctor | replay | view |\n|---|---|---|---|---|")
        for name in given.mishaps:
            told = apply_fault(MISHAPS[name], folder / f"{name}.mcap")
            print(f"| {name} | {told.run} | {told.doctor} | {told.replay} | {told.view} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
