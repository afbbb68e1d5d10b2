"""Cost over time, one line for each run, with the total that its first plan expected as a dashed line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from dashboards.figures.style import labels_of
from dashboards.model.timeline import Timeline
from dashboards.palette import run_colour, unit_rgb

MAX_INSIDE_LEGEND = 3
"""The most lines with the legend inside the axes; with more, it is below."""


def draw_cost_over_time(ax: Axes, timelines: Sequence[Timeline]) -> None:
    """Draws cost so far over seconds; a dot at each search, a ring at the end, a cross where a run ended undone."""
    names = labels_of(timelines)
    for i, timeline in enumerate(timelines):
        colour = unit_rgb(run_colour(i))
        ax.plot(timeline.cost_s, timeline.cost, color=colour, label=_in_key(names[i], timeline), zorder=3 - i / 10)
        searched = [timeline.seconds(a.stamp.ns) for a in timeline.actions if a.action == "search"]
        ax.plot(
            searched,
            np.interp(searched, timeline.cost_s, timeline.cost),
            linestyle="none",
            marker="o",
            markersize=2.2,
            color=colour,
            zorder=4,
        )
        ax.plot(
            timeline.cost_s[-1],
            timeline.cost[-1],
            marker="o" if timeline.status == "done" else "X",
            markersize=5,
            markerfacecolor="white",
            color=colour,
            zorder=5,
        )
    first = timelines[0]
    plans = [d.plan for d in first.decisions if d.plan is not None and d.plan.steps]
    expected = [(first.seconds(p.stamp.ns), p.expected_cost) for p in plans if p.expected_cost is not None]
    if expected:
        at = [second for second, _ in expected]
        total = np.interp(at, first.cost_s, first.cost) + [cost for _, cost in expected]
        whose = f" by {names[0]}" if len(timelines) > 1 else ""
        ax.step(
            [*at, first.duration_s],
            [*total, total[-1]],
            where="post",
            color=unit_rgb(run_colour(0)),
            linewidth=0.9,
            linestyle=(0, (4, 2)),
            label=f"expected in all{whose}",
        )
    ax.set_xlabel("time (s)")
    ax.set_ylabel("cost")
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    beside = {"loc": "upper left", "bbox_to_anchor": (0.0, -0.2)} if len(timelines) > MAX_INSIDE_LEGEND else {}
    ax.legend(**beside)


def _in_key(name: str, timeline: Timeline) -> str:
    """The run's name; for one that did not do its task also how it ended, since its line stops short of a cost."""
    return name if timeline.status == "done" else f"{name} ({timeline.status})"
