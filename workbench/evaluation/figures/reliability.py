"""Reliability diagrams: observed frequency against predicted probability, by bin."""

from __future__ import annotations

from matplotlib.axes import Axes

from workbench.evaluation.beliefs.metrics import Reliability


def draw_reliability(ax: Axes, bins: Reliability, *, name: str, ece: float, colour: str) -> None:
    """Draw a reliability diagram: points on the diagonal are calibrated; the area of a point is the share of pairs
    in its bin."""
    filled = bins.count > 0
    share = bins.count[filled] / bins.count.sum()
    ax.plot([0, 1], [0, 1], color="#888888", linewidth=0.8, zorder=1)
    ax.plot(bins.said[filled], bins.was[filled], color=colour, linewidth=1.0, zorder=2)
    ax.scatter(
        bins.said[filled], bins.was[filled], s=12 + 300 * share, color=colour, linewidths=0, alpha=0.8, zorder=3
    )
    ax.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xlabel="probability said", ylabel="share that held")
    ax.set_title(f"{name}: calibration error {ece:.4f}", fontsize=9)
