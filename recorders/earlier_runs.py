"""The history of a place from logs of earlier runs, for a run that remembers them.

Only `replayers` reads MCAP, and it builds on this package: its reader is found by its entry point, as commands are.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import entry_points
from pathlib import Path

from workbench.beliefs.memory.history import History
from workbench.beliefs.memory.move_rates import MoveRates, read_rates, shipped_rates
from workbench.errors import Failed

GROUP, NAME = "lios.readers", "history"


class NoReader(Failed):
    """The installation lacks the reader of logs."""

    def __init__(self) -> None:
        super().__init__("this installation has no reader of earlier logs. Install lios-workbench again.")


def read_history(logs: Sequence[Path]) -> History:
    """The history that logs, or folders of logs, hold.

    Raises:
        NoReader: the installation is not whole.
        InputError: there is nothing to remember, or the logs are not of one place or contradict one another.
    """
    found = next(iter(entry_points(group=GROUP, name=NAME)), None)
    if found is None:
        raise NoReader
    return found.load()(logs)


def move_rates(path: Path | None) -> MoveRates:
    """The rates in a file; the shipped ones where none is given.

    Raises:
        FileMissing, MalformedFile: no such file, or none of rates.
    """
    return shipped_rates() if path is None else read_rates(path)
