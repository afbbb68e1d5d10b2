"""Reads the runs that are drawn together: those of the same place as the first, since only they fit one house."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dashboards.library.library import Library
from dashboards.model.timeline import Timeline
from workbench.errors import LiosError
from workbench.terminal import say


@dataclass(frozen=True, slots=True, kw_only=True)
class RunsTogether:
    """Runs to be drawn together.

    Attributes:
        timelines: the first is in focus; those of other places are among them.
        unreadable: logs of a folder that cannot be read as runs, and why.
    """

    timelines: tuple[Timeline, ...]
    unreadable: Mapping[Path, str]

    @property
    def left_out(self) -> list[str]:
        """The logs that are not drawn."""
        return [*(str(t.run.path) for t in other_houses(self.timelines)), *map(str, self.unreadable)]


def read_together(logs: Sequence[Path]) -> RunsTogether:
    """Reads the runs to be shown together, the first in focus; prints which are left out, and why.

    Raises:
        FileMissing, NoLogsInFolder and the other errors of reading a log: of a log that is named itself, and of the
            first log of a folder in which none can be read.
    """
    library = Library(logs)
    named = {path.resolve() for path in logs if not path.is_dir()}
    timelines, errors = list[Timeline](), dict[Path, LiosError]()
    for index, path in enumerate(library.paths):
        try:
            timelines.append(library.timeline(index))
        except LiosError as error:
            if path.resolve() in named:
                raise
            errors[path] = error
    if not timelines:
        raise next(iter(errors.values()))
    for error in errors.values():
        say(f"Left out: {error}")
    print_left_out(timelines)
    return RunsTogether(timelines=tuple(timelines), unreadable={path: str(e) for path, e in errors.items()})


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
