"""Comparison of runs of one task: the cost of each, by kind of action."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from dashboards.figures.style import labels_of
from dashboards.model.phases import KINDS, kind_of
from dashboards.model.timeline import Timeline
from dashboards.palette import PHASES
from dashboards.panels.markup import number
from workbench.tolerances import NEAR_COST

SAME = 0.05
"""A charged cost that differs by less from the spent cost is shown as the same."""


def draw_comparison(ax: Axes, timelines: Sequence[Timeline]) -> None:
    """One bar for each run: cost by kind of action; a line from bound to bound where the log cannot settle the
    cost."""
    names = labels_of(timelines)
    left = np.zeros(len(timelines))
    for kind in KINDS:
        parts = np.array([sum(a.cost for a in t.actions if kind_of(a) == kind) for t in timelines])
        if parts.any():
            ax.barh(range(len(names)), parts, left=left, height=0.62, color=PHASES[kind], label=kind)
        left += parts
    for i, timeline in enumerate(timelines):
        words = _in_words(timeline, left[i])
        if timeline.undecided is not None:
            lower, upper = timeline.undecided
            ax.plot([lower, upper], [i, i], color="#23262b", linewidth=0.9, marker="|", zorder=4)
            words, left[i] = f"{number(lower)} to {number(upper)}", upper
        ax.text(left[i], i, f" {words}", va="center", fontsize=7)
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set_xlabel("cost")
    ax.set_xlim(0, max(left.max() if len(left) else 0.0, NEAR_COST) * 1.2)
    ax.tick_params(axis="y", length=0)
    ax.spines["left"].set_visible(False)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)


def _in_words(timeline: Timeline, spent: float) -> str:
    """The spent cost; for a failed run also how it ended and the charged cost."""
    outcome = timeline.run.outcome
    if timeline.status == "done":
        return number(spent)
    charged = f" (charged {number(outcome.cost)})" if outcome is not None and abs(outcome.cost - spent) > SAME else ""
    return f"{number(spent)}, {timeline.status}{charged}"
