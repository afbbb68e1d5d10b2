"""Benchmark: `lios evaluate replay` on a Dask cluster of one worker and of two, on this machine.

    python tests/benchmarks/dask_speed.py [--counterfactuals 800] [--rounds 2]

The two take turns. Printed are the medians of the whole command's wall time, start of the cluster included, and how
many times faster two workers are: with the start, and without it (the time of a command of one task is taken off).
The rows of both must be the same bytes. Client and scheduler need a core too: with two cores, none is left for them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

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


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--counterfactuals", type=int, default=800)
    options.add_argument("--rounds", type=int, default=2)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        rows = {workers: Path(name) / f"{workers}.csv" for workers in (1, 2)}
        start_s = {workers: _seconds(1, workers, rows[workers]) for workers in (1, 2)}  # fills numba's caches, too
        start_s = {workers: _seconds(1, workers, rows[workers]) for workers in (1, 2)}
        taken = [
            {workers: _seconds(given.counterfactuals, workers, rows[workers]) for workers in (1, 2)}
            for _ in range(given.rounds)
        ]
        if rows[1].read_bytes() != rows[2].read_bytes():
            sys.exit("one worker and two gave other rows")
    whole = median(seconds[1] / seconds[2] for seconds in taken)
    work = median((seconds[1] - start_s[1]) / (seconds[2] - start_s[2]) for seconds in taken)
    print(f"cores: {os.cpu_count()}, counterfactuals: {given.counterfactuals}, rounds: {given.rounds}")
    for workers in (1, 2):
        spent = median(seconds[workers] for seconds in taken)
        print(f"{workers} worker(s): {spent:.1f} s, one task alone {start_s[workers]:.1f} s")
    print(f"two workers are {whole:.2f} times as fast, {work:.2f} times without the start")


def _seconds(counterfactuals: int, workers: int, rows: Path) -> float:
    """Wall time of one evaluation by this many workers."""
    command = [sys.executable, *EVALUATION, "-n", str(counterfactuals), "-o", str(rows)]
    began = time.perf_counter()
    subprocess.run(
        [*command, "--scheduler", "local", "-j", str(workers)],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "LIOS_CACHE": "off"},
    )
    return time.perf_counter() - began


if __name__ == "__main__":
    main()
