"""The path of the robot and its order of search, from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from dashboards.figures.floor_plan import draw_floor_plan
from dashboards.figures.style import labels_of, scale_bar
from dashboards.model.scene import scene_at
from dashboards.model.timeline import NEVER, Timeline
from dashboards.palette import FOUND, run_colour, unit_rgb

FIRST_WIDTH, MIN_WIDTH = 2.6, 0.8


def draw_trajectory(ax: Axes, timelines: Sequence[Timeline]) -> None:
    """Draws the paths of runs over their place; the first run's searches are numbered, its find is green."""
    first = timelines[0]
    draw_floor_plan(ax, first.plan)
    for i in range(len(timelines) - 1, -1, -1):
        # Where paths coincide, later ones are thinner and on top of earlier ones, so that all can be seen.
        width = max(MIN_WIDTH, FIRST_WIDTH - 0.7 * i)
        ax.plot(*timelines[i].path_xy.T, color=unit_rgb(run_colour(i)), linewidth=width, zorder=5 + i / 10)
    ax.plot(
        *first.path_xy[0],
        marker="o",
        markersize=4.5,
        color="#23262b",
        markeredgecolor="white",
        markeredgewidth=0.5,
        zorder=8,
    )
    _number_searches(ax, first)
    if len(timelines) > 1:
        handles = [
            Line2D([], [], color=unit_rgb(run_colour(i)), label=name) for i, name in enumerate(labels_of(timelines))
        ]
        ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.04), ncols=min(4, len(handles)))
    scale_bar(ax)


def _number_searches(ax: Axes, timeline: Timeline) -> None:
    order = [i for i in np.argsort(timeline.searched_ns, kind="stable") if timeline.searched_ns[i] != NEVER]
    found = scene_at(timeline, timeline.end_ns).holds_focus
    for number, i in enumerate(order, 1):
        pose = timeline.plan.containers[i].pose
        colour = unit_rgb(FOUND) if found[i] else unit_rgb(run_colour(0))
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
