"""The history of a place from logs of earlier runs, for a run that remembers them.

Only `replayers` reads MCAP, and it builds on this package: its reader is found by our entry point.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from workbench.beliefs.memory.history import History
from workbench.beliefs.memory.memory import Memory
from workbench.beliefs.memory.move_rates import MoveRates, read_rates, shipped_rates
from workbench.errors import BadValue, Failed
from workbench.plugins import own_entries
from workbench.terminal import say
from workbench.worlds.house import FloorPlan

GROUP, NAME = "lios.readers", "history"


class NoReader(Failed):
    """The installation lacks the reader of logs."""

    def __init__(self) -> None:
        super().__init__("this installation has no reader of earlier logs. Install lios-workbench again.")


def read_history(logs: Sequence[Path], place: FloorPlan) -> History:
    """The history of a place that logs, or folders of logs, hold; says what is left out, and what people corrected.

    Raises:
        NoReader: the installation is not whole.
        InputError: there is nothing to remember, a log that is named is of another place, or logs contradict one
            another.
    """
    found = next((entry for entry in own_entries(GROUP) if entry.name == NAME), None)
    if found is None:
        raise NoReader
    history: History = found.load()(logs, place)
    for note in history.notes:
        say(f"note: {note}")
    return history


def memory_now(logs: Sequence[Path] | None, rates: Path | None, plan: FloorPlan) -> Memory | None:
    """What a robot remembers that begins now, by this computer's clock; None where no logs are given.

    Raises:
        BadValue: rates without logs.
        InputError: as read_history, or the logs are of another place.
    """
    if not logs:
        if rates is not None:
            raise BadValue("move rates", str(rates), "given together with --memory")
        return None
    return read_history(logs, plan).memory_at(time.time_ns(), plan, move_rates(rates))


def move_rates(path: Path | None) -> MoveRates:
    """The rates in a file; the shipped ones where none is given.

    Raises:
        FileMissing, MalformedFile: no such file, or none of rates.
    """
    return shipped_rates() if path is None else read_rates(path)
