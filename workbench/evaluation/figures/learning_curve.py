"""How many houses does an estimator need? Log loss and top-1 over the number of houses it learnt from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes


def draw_learning_curve(
    ax: Axes, houses: Sequence[int], values: Mapping[str, Sequence[float]], *, colours: Mapping[str, str], label: str
) -> None:
    """One line an estimator.

    Args:
        houses: how many were learnt from.
        values: per estimator, a figure for each number of houses.
        label: what the figure is.
    """
    for name, line in values.items():
        ax.plot(houses, line, marker="o", markersize=4, linewidth=1.2, color=colours.get(name), label=name)
    ax.set_xscale("log", base=2)
    ax.set_xticks(list(houses), [str(n) for n in houses])
    ax.minorticks_off()
    ax.set(xlabel="houses learnt from", ylabel=label)
    ax.legend(fontsize=7, frameon=False)
