"""A scatter plot of the costs of two strategies, one point per trial, as in the paper."""

from __future__ import annotations

from matplotlib.axes import Axes

from workbench.arrays import Floats
from workbench.evaluation.figures.style import BLUE, disable_math_text
from workbench.evaluation.tasks.names import shortened, strategy_title
from workbench.tolerances import NEAR_COST


def draw_task_scatter(ax: Axes, baseline: Floats, ours: Floats, *, names: tuple[str, str]) -> None:
    """Draw the charged costs of the same trials; below the line the second strategy is cheaper.

    Args:
        baseline, ours: shape (trials,).
        names: names of both, in that order.
    """
    theirs, mine = (shortened(strategy_title(name), 24) for name in names)
    most = float(max(baseline.max(), ours.max(), 1.0)) * 1.05
    ax.plot([0, most], [0, most], color="#888888", linewidth=0.8, zorder=1)
    ax.scatter(baseline, ours, s=11, alpha=0.55, linewidths=0, color=BLUE, zorder=2)
    ax.set(xlim=(0, most), ylim=(0, most), aspect="equal", xlabel=f"cost of {theirs}", ylabel=f"cost of {mine}")
    saved = 1 - ours.sum() / baseline.sum() if baseline.sum() else 0.0
    wins, losses = float((ours < baseline - NEAR_COST).mean()), float((ours > baseline + NEAR_COST).mean())
    ax.set_title(f"{100 * saved:+.1f} % saved\nbetter {100 * wins:.0f} %, worse {100 * losses:.0f} %", fontsize=8)
    disable_math_text(ax)
