"""Benchmark: `lios evaluate replay` on a Dask cluster of one worker and of two, on this machine.

    python tests/benchmarks/dask_speed.py [--counterfactuals 800] [--rounds 2]

The two take turns. Printed are medians of the processor time of each process (the command, which holds client and
scheduler, and each worker), its start included, and of the whole command's wall time. Two figures say how many times
faster two workers are. By processor time: that of the one worker against that of the busier of the two, which is what
counts where each worker has a core to itself. By wall time: this holds only where nothing else runs, and a core is
left for client and scheduler. The rows of both must be the same bytes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import psutil

EVALUATION = (
    "-m",
    "workbench",
    "evaluate",
    "replay",
    "--scenarios",
    "deliver-3",
    "--estimators",
    "counts",
    "--force",
)
LOOK_EVERY_S = 0.1


@dataclass(frozen=True)
class Spent:
    """What one command took, in seconds.

    Attributes:
        wall: from start to end.
        command: processor time of the command's own process: client and scheduler.
        workers: processor time of each worker, the busiest first.
    """

    wall: float
    command: float
    workers: tuple[float, ...]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--counterfactuals", type=int, default=800)
    options.add_argument("--rounds", type=int, default=2)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        rows = {workers: Path(name) / f"{workers}.csv" for workers in (1, 2)}
        for workers in (1, 2):
            _run(1, workers, rows[workers])  # fills numba's caches
        rounds = [
            {workers: _run(given.counterfactuals, workers, rows[workers]) for workers in (1, 2)}
            for _ in range(given.rounds)
        ]
        if rows[1].read_bytes() != rows[2].read_bytes():
            sys.exit("one worker and two gave other rows")
    print(f"cores: {os.cpu_count()}, counterfactuals: {given.counterfactuals}, rounds: {given.rounds}")
    for workers in (1, 2):
        each = [f"{median(taken[workers].workers[k] for taken in rounds):.1f}" for k in range(workers)]
        command = median(taken[workers].command for taken in rounds)
        wall = median(taken[workers].wall for taken in rounds)
        print(f"{workers} worker(s): processor s {' + '.join(each)}, command {command:.1f}; wall {wall:.1f} s")
    by_processor = median(taken[1].workers[0] / taken[2].workers[0] for taken in rounds)
    by_wall = median(taken[1].wall / taken[2].wall for taken in rounds)
    print(f"two workers are {by_processor:.2f} times as fast by processor time, {by_wall:.2f} times by wall time")


def _run(counterfactuals: int, workers: int, rows: Path) -> Spent:
    """One evaluation by this many workers."""
    words = ("-n", str(counterfactuals), "-o", str(rows), "--scheduler", "local", "-j", str(workers))
    began = time.perf_counter()
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    command = psutil.Popen([sys.executable, *EVALUATION, *words], env={**os.environ, "LIOS_CACHE": "off"}, **quiet)
    spent: dict[int, float] = {}
    while command.poll() is None:
        for process in (command, *_children(command)):
            try:
                used = process.cpu_times()
            except psutil.Error:
                continue
            spent[process.pid] = used.user + used.system
        time.sleep(LOOK_EVERY_S)
    wall = time.perf_counter() - began
    if command.returncode:
        sys.exit(f"the evaluation ended with exit code {command.returncode}")
    own = spent.pop(command.pid)
    return Spent(wall, own, tuple(sorted(spent.values(), reverse=True)[:workers]))


def _children(command: psutil.Popen) -> list[psutil.Process]:
    try:
        return command.children(recursive=True)
    except psutil.Error:
        return []


if __name__ == "__main__":
    main()
