"""Which of several runs are of the place of the first? Only those can be drawn into one house; others are told of."""

from __future__ import annotations

from collections.abc import Sequence

from dashboards.timeline import Timeline
from workbench.terminal import say


def here(timelines: Sequence[Timeline]) -> tuple[Timeline, ...]:
    """The runs of the first one's place."""
    return tuple(t for t in timelines if t.plan == timelines[0].plan)


def left_out(timelines: Sequence[Timeline]) -> tuple[Timeline, ...]:
    """The runs of other places."""
    return tuple(t for t in timelines if t.plan != timelines[0].plan)


def say_left_out(timelines: Sequence[Timeline]) -> tuple[Timeline, ...]:
    """Tells a person, one line a run, which are left out; returns them."""
    elsewhere = left_out(timelines)
    for timeline in elsewhere:
        say(f"Left out: {timeline.run.path} is of {timeline.run.info.place}, not of {timelines[0].run.info.place}.")
    return elsewhere
