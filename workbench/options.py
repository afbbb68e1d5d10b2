"""Command-line options that several commands share, each with one name, one meaning and one sentence of help.

A command takes what it needs as an annotation: `houses: Houses = None`. It imports this at run time, not for types
alone, since annotations are read when the command is built.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.parameters import Option
from workbench.worlds.shipped import house_file

MOST = 1_000_000
"""Worlds, trials and the like in one command: more would fill the memory before any work is done."""

Houses = Annotated[
    Path | None,
    Option("--houses", help="Houses (.jsonl.gz, .jsonl, .json); default: the shipped ones.", file=house_file),
]
Split = Annotated[str, Option("--split", help="train, validation, test or all; a file without splits is used whole.")]
Assets = Annotated[Path | None, Option("--assets", help="Asset table (CSV) with exact sizes.")]
AssetsOrBeside = Annotated[
    Path | None,
    Option("--assets", help="Asset table (CSV) with exact sizes; default: asset_sizes.csv beside the houses."),
]
FoldCount = Annotated[
    int | None,
    Option("--folds", help="Cross-validate: retrain per fold and evaluate on the held-out houses."),
]
AlsoLearnt = Annotated[
    list[Path] | None,
    Option(
        "--also", help="With --folds: further training houses that are not evaluated; repeatable.", file=house_file
    ),
]
MemoryLogs = Annotated[
    list[Path] | None,
    Option("--memory", help="Logs of earlier runs of the place to remember, or a folder of them; repeatable."),
]
MoveRatesFile = Annotated[
    Path | None,
    Option("--rates", help="With --memory: how often things move (lios learn-moves); default: the shipped rates."),
]
Workers = Annotated[int, Option("--workers", "-j", min=1, help="Processes on this machine.")]
Scheduler = Annotated[
    str, Option("--scheduler", help="A Dask scheduler (tcp://HOST:PORT), or local for a Dask cluster here.")
]
MissRate = Annotated[
    float,
    Option(
        "--miss-rate",
        help="Probability that a look misses an item, drawn for each item and look; looks may be repeated.",
    ),
]
Sees = Annotated[
    float,
    Option("--sees", help="Metres from which the robot sees open furniture in passing; 0 for not at all."),
]
LogEstimator = Annotated[
    str,
    Option(
        "--estimator",
        help='"log": as in the log; "first": the log\'s first belief, held fixed; or a name: best, people, ...',
    ),
]
BoundsBudget = Annotated[
    int | None,
    Option(
        "--budget",
        min=1,
        help="Segments of the loop, between unopened containers, to spend on the bounds of one replay; default: "
        "1500, or 400 for a strategy that simulates or is not built in.",
    ),
]
RecordTrials = Annotated[bool, Option("--record", help="Record every trial to OUTPUT/logs as MCAP.")]
Upload = Annotated[
    str, Option("--upload", help="Also upload what was written to this address, such as s3://bucket/runs/.")
]
DryRun = Annotated[bool, Option("--dry-run", help="Print what would be run and stop.")]
Force = Annotated[bool, Option("--force", help="Replace the output.")]
Ask = Annotated[
    bool, Option("--ask", help="Ask the --estimator for answers that neither the log nor the cache holds.")
]
Json = Annotated[bool, Option("--json", help="Print the result as JSON on standard output.")]
ServePort = Annotated[
    int | None,
    Option(
        "--serve",
        min=0,
        max=65535,
        help="While recording, serve it to Foxglove or Lichtblick on this port of this machine (usually 8765).",
    ),
]
