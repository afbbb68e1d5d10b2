"""Where did the robot go, and in which order did it search? The house from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from dashboards.figures.floor_plan import draw_floor_plan
from dashboards.figures.style import scale_bar
from dashboards.palette import FOUND, run_colour, unit
from dashboards.scene import scene_at
from dashboards.timeline import NEVER, Timeline


def draw_trajectory(ax: Axes, timelines: Sequence[Timeline]) -> None:
    """The ways of runs over their place; the first run's searches are numbered, its find is green."""
    first = timelines[0]
    if first.plan is not None:
        draw_floor_plan(ax, first.plan)
    for i in range(len(timelines) - 1, -1, -1):
        way = timelines[i].way_xy
        colour = unit(run_colour(i))
        ax.plot(
            *way.T, color=colour, linewidth=1.5 if i == 0 else 1.0, alpha=1.0 if i == 0 else 0.8, zorder=5 - i / 10
        )
    ax.plot(*first.way_xy[0], marker="o", markersize=4.5, color="#23262b", zorder=6)
    _number_searches(ax, first)
    if len(timelines) > 1:
        handles = [
            Line2D([], [], color=unit(run_colour(i)), label=t.run.info.strategy) for i, t in enumerate(timelines)
        ]
        ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=min(4, len(handles)))
    scale_bar(ax)


def _number_searches(ax: Axes, timeline: Timeline) -> None:
    if timeline.plan is None:
        return
    order = [i for i in np.argsort(timeline.searched_ns, kind="stable") if timeline.searched_ns[i] != NEVER]
    found = scene_at(timeline, timeline.end_ns).holds_focus
    for number, i in enumerate(order, 1):
        pose = timeline.plan.containers[i].pose
        colour = unit(FOUND) if found[i] else unit(run_colour(0))
        ax.text(
            pose.x_m,
            pose.y_m,
            str(number),
            ha="center",
            va="center",
            fontsize=5.5,
            color="white",
            zorder=7,
            bbox={"boxstyle": "circle,pad=0.22", "facecolor": colour, "edgecolor": "white", "linewidth": 0.5},
        )
