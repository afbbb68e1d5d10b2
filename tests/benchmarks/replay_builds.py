"""Benchmark: the same replays by two builds, side by side in one run: processor time of the whole command.

python tests/benchmarks/replay_builds.py OTHER/.venv/bin/lios OTHER/logs/deliver-3.mcap
python tests/benchmarks/replay_builds.py OTHER/.venv/bin/lios FOLDER --strategies opt-greedy,opt-lios,model-lios

OTHER is a checkout of another build with its own environment. Each command runs in one process (--workers 1); the
first round of each loads and compiles, and does not count: byte code is kept for both in a folder of this run. The
least of the rounds is printed, and their ratio.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the command lios of the other build")
    parser.add_argument("logs", nargs="+", type=Path, help="logs or folders of logs that both builds read")
    parser.add_argument("--strategies", default="all")
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    builds = {"this build": [sys.executable, "-m", "workbench"], "the other": [str(given.other.absolute())]}
    what = [
        "replay",
        *(str(log.absolute()) for log in given.logs),
        "-s",
        given.strategies,
        "--workers",
        "1",
        "--json",
    ]
    least = {name: float("inf") for name in builds}
    with TemporaryDirectory() as folder:
        for round_, (name, command) in product(range(given.rounds + 1), builds.items()):
            cpu_s, wall_s, reached, rows = _measured([*command, *what], byte_code=folder)
            if round_:
                least[name] = min(least[name], cpu_s)
            load = os.getloadavg()[0]
            print(
                f"round {round_}: {name:10} {cpu_s:7.2f} s of processor time, {wall_s:7.2f} s; both ends reached "
                f"in {reached} of {rows}; load {load:.1f}",
                flush=True,
            )
    print(
        f"{least['this build']:.2f} s to {least['the other']:.2f} s: {least['this build'] / least['the other']:.2f}"
    )


def _measured(command: list[str], *, byte_code: str) -> tuple[float, float, int, int]:
    """Processor and wall time of a command, its replays with both ends reached, and all its replays."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": byte_code}
    done = subprocess.run(command, capture_output=True, check=True, env=environment)
    after, wall_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - began
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    rows = json.loads(done.stdout)["rows"]
    reached = sum(row["lower_proof"] == row["upper_proof"] == "exact" for row in rows)
    return cpu_s, wall_s, reached, len(rows)


if __name__ == "__main__":
    main()
