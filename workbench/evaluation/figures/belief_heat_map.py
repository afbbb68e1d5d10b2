"""A heat map of the mean probability of an item by room kind and container type."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from workbench.arrays import Floats


def draw_belief_heat_map(
    ax: Axes, mean: Floats, *, rooms: Sequence[str], containers: Sequence[str], item: str
) -> None:
    """Draw a grid of room kinds by container types; pairs that do not occur stay blank.

    Args:
        mean: shape (rooms, containers), NaN for pairs that do not occur.
    """
    ax.imshow(np.ma.masked_invalid(mean), cmap="viridis", vmin=0, vmax=1, aspect="auto")
    for i in range(len(rooms)):
        for j in range(len(containers)):
            if np.isfinite(mean[i, j]):
                shade = "black" if mean[i, j] > 0.6 else "white"
                ax.text(j, i, f"{mean[i, j]:.2f}"[1:], ha="center", va="center", fontsize=5.5, color=shade)
    ax.set_xticks(range(len(containers)), list(containers), rotation=60, ha="right", fontsize=6)
    ax.set_yticks(range(len(rooms)), list(rooms), fontsize=7)
    ax.set_title(item, fontsize=9)
