"""A heat map of the mean probability of an item by room kind and container type."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from workbench.arrays import Floats
from workbench.belief_colours import belief_colours

DARK = 0.45
"""Where the ground is so dark that white letters read better than black ones."""


def draw_belief_heat_map(
    ax: Axes, mean: Floats, *, rooms: Sequence[str], containers: Sequence[str], item: str
) -> None:
    """Draw a grid of room kinds by container types; pairs that do not occur stay blank.

    Args:
        mean: shape (rooms, containers), NaN for pairs that do not occur.
    """
    shades = np.where(np.isfinite(mean)[..., None], belief_colours(mean), 255).astype(np.uint8)
    ax.imshow(shades, aspect="auto")
    for i in range(len(rooms)):
        for j in range(len(containers)):
            if np.isfinite(mean[i, j]):
                shade = "white" if mean[i, j] > DARK else "black"
                ax.text(j, i, f"{mean[i, j]:.2f}"[1:], ha="center", va="center", fontsize=5.5, color=shade)
    ax.set_xticks(range(len(containers)), list(containers), rotation=60, ha="right", fontsize=6)
    ax.set_yticks(range(len(rooms)), list(rooms), fontsize=7)
    ax.set_title(item, fontsize=9)
