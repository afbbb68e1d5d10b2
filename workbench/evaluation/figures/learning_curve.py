"""Learning curves: log loss and top-1 over the number of training houses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes


def draw_learning_curve(
    ax: Axes, houses: Sequence[int], values: Mapping[str, Sequence[float]], *, colours: Mapping[str, str], label: str
) -> None:
    """Draw one line per estimator.

    Args:
        houses: numbers of training houses.
        values: per estimator, a value for each number of houses.
        label: name of the metric.
    """
    for name, line in values.items():
        ax.plot(houses, line, marker="o", markersize=4, linewidth=1.2, color=colours.get(name), label=name)
    ax.set_xscale("log", base=2)
    ax.set_xticks(list(houses), [str(n) for n in houses])
    ax.minorticks_off()
    ax.set(xlabel="houses learnt from", ylabel=label)
    ax.legend(fontsize=7, frameon=False)
