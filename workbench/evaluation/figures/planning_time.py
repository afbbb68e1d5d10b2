"""The distribution of decision times by scenario."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from workbench.arrays import Floats
from workbench.evaluation.figures.style import disable_math_text
from workbench.evaluation.tasks.names import scenario_title, shortened

MAX_INLINE_LABELS = 6
"""With more scenarios than this, names are placed beside the plot."""

MAX_FINE_DECADES = 2.5
"""Up to so many decades have ticks at 1, 2 and 5; more have them at 1 only."""


def draw_planning_time(ax: Axes, seconds: Mapping[str, Floats], *, share_of_belief: float | None = None) -> None:
    """Draw the share of decisions made within a time, one line per scenario.

    Args:
        seconds: per scenario, the total time of each decision, shape (decisions,).
        share_of_belief: share of the total time spent on beliefs; for the title.
    """
    for scenario, values in seconds.items():
        if len(values) == 0:
            continue
        sorted_ms = np.sort(values) * 1e3
        ax.step(sorted_ms, np.arange(1, len(values) + 1) / len(values), label=shortened(scenario_title(scenario), 30))
    ax.set(xscale="log", xlabel="belief, find costs and plan of one decision, ms", ylabel="share of decisions")
    ax.xaxis.set_major_locator(LogLocator(subs=_ticks(seconds)))
    ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.grid(alpha=0.25, linewidth=0.5)
    if not ax.lines:
        ax.text(0.5, 0.5, "no decision was made", transform=ax.transAxes, ha="center")
    elif len(seconds) > MAX_INLINE_LABELS:
        ax.legend(fontsize=7, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    else:
        ax.legend(fontsize=7, frameon=False, loc="lower right")
    disable_math_text(ax)
    if share_of_belief is not None:
        ax.set_title(f"{100 * share_of_belief:.0f} % of the time believing, the rest planning", fontsize=8)


def _ticks(seconds: Mapping[str, Floats]) -> tuple[float, ...]:
    """The labelled ticks of a decade, chosen so that labels do not overlap."""
    values = np.concatenate([*seconds.values(), np.ones(0)])
    values = values[values > 0]
    decades = float(np.log10(values.max() / values.min())) if len(values) else 0.0
    return (1.0, 2.0, 5.0) if decades <= MAX_FINE_DECADES else (1.0,)
