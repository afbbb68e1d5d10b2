"""Realised against predicted search cost, with means by deciles of the prediction."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from workbench.arrays import Floats

GROUPS = 10


def draw_predicted_cost(
    ax: Axes,
    predicted: Floats,
    realised: Floats,
    *,
    name: str,
    colour: str,
) -> None:
    """Draw every trial as a point, and the mean of each decile by predicted cost as a line.

    Args:
        predicted, realised: shape (trials,).
    """
    most = float(np.quantile(np.concatenate([predicted, realised]), 0.98))
    ax.plot([0, most], [0, most], color="#888888", linewidth=0.8)
    ax.scatter(predicted, realised, s=5, alpha=0.25, linewidths=0, color=colour)
    groups = np.array_split(np.argsort(predicted, kind="stable"), min(GROUPS, len(predicted)))
    means = np.array([(predicted[g].mean(), realised[g].mean()) for g in groups])
    ax.plot(means[:, 0], means[:, 1], "o-", color="black", markersize=4, linewidth=1.2, label="mean of a tenth")
    ratio = realised.sum() / predicted.sum() if predicted.sum() else float("nan")
    ax.set(xlim=(0, most), ylim=(0, most), aspect="equal", xlabel="predicted cost", ylabel="realised cost")
    ax.set_title(f"{name}: realised / predicted {ratio:.3f}", fontsize=9)
    ax.legend(fontsize=7, frameon=False, loc="upper left")
