"""Selects the runs that are of the same place as the first; only those can be drawn into one house."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dashboards.library.library import Library
from dashboards.model.timeline import Timeline
from workbench.terminal import say


def read_together(logs: Sequence[Path]) -> list[Timeline]:
    """Reads the runs to be shown together, the first in focus; prints which are left out as of another place.

    Raises:
        FileMissing, NoLogsInFolder and the other errors of reading a log.
    """
    library = Library(logs)
    timelines = [library.timeline(index) for index in range(len(library.paths))]
    print_left_out(timelines)
    return timelines


def same_house(timelines: Sequence[Timeline]) -> tuple[Timeline, ...]:
    """The runs of the first one's place."""
    return tuple(t for t in timelines if t.plan == timelines[0].plan)


def other_houses(timelines: Sequence[Timeline]) -> tuple[Timeline, ...]:
    """The runs of other places."""
    return tuple(t for t in timelines if t.plan != timelines[0].plan)


def print_left_out(timelines: Sequence[Timeline]) -> None:
    """Prints, one line for each run, which are left out."""
    for timeline in other_houses(timelines):
        say(f"Left out: {timeline.run.path} is of {timeline.run.info.place}, not of {timelines[0].run.info.place}.")
