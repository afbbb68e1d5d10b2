"""A scatter plot of a policy's costs against Greedy's, one point per trial, as in the paper's Fig. 5 (left)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from workbench.arrays import Floats
from workbench.evaluation.figures.style import BLUE, ORANGE
from workbench.tolerances import ROUNDING

KIND_COLOURS = {"ai2-thor": BLUE, "objaverse": ORANGE}


def draw_cost_scatter(
    ax: Axes,
    greedy: Floats,
    other: Floats,
    *,
    kinds: Sequence[str],
    name: str,
) -> None:
    """Draw the costs of the same trials against each other; below the line the policy is cheaper than Greedy.

    Args:
        greedy, other: shape (trials,).
        kinds: kind of item of each trial.
    """
    most = float(max(greedy.max(), other.max())) * 1.03
    ax.plot([0, most], [0, most], color="#888888", linewidth=0.8, zorder=1)
    for kind in dict.fromkeys(kinds):
        these = np.array([k == kind for k in kinds])
        ax.scatter(
            greedy[these],
            other[these],
            s=9,
            alpha=0.45,
            linewidths=0,
            color=KIND_COLOURS.get(kind),
            label=f"{kind} ({these.sum()})",
            zorder=2,
        )
    ax.set(xlim=(0, most), ylim=(0, most), aspect="equal", xlabel="cost of Greedy", ylabel=f"cost of {name}")
    saved = 1 - other.sum() / greedy.sum()
    worse = np.mean(other > greedy + ROUNDING)
    ax.set_title(f"{name}: {100 * saved:.1f} % below Greedy, worse in {100 * worse:.0f} %", fontsize=9)
    ax.legend(fontsize=7, frameon=False, loc="upper left")
