"""What does each strategy cost in each scenario, and does it succeed? Bars with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from matplotlib.axes import Axes

from workbench.evaluation.figures.style import BLUE, GREEN, GREY, ORANGE, PINK, SKY, VERMILION
from workbench.planning.scenarios import PAPER_TITLES
from workbench.planning.strategies import PAPER_NAMES

DARK = "#000000"
STRATEGY_COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "opt-greedy": GREY,
        "pes-greedy": "#A0A0A0",
        "opt-lios": ORANGE,
        "pes-lios": PINK,
        "model-lios": VERMILION,
        "conditioned-lios": BLUE,
        "scout-lios": GREEN,
        "oracle": DARK,
    }
)


def draw_task_bars(ax: Axes, lines: Sequence[Mapping[str, Any]], *, value: str = "mean_cost") -> None:
    """Groups of bars, a group a scenario.

    Args:
        lines: rows of task_table.table.
        value: mean_cost (with its interval) or success_rate.
    """
    scenarios = list(dict.fromkeys(line["scenario"] for line in lines))
    strategies = list(dict.fromkeys(line["strategy"] for line in lines))
    width = 0.85 / max(len(strategies), 1)
    for j, strategy in enumerate(strategies):
        mine = {line["scenario"]: line for line in lines if line["strategy"] == strategy}
        at = [i + (j - (len(strategies) - 1) / 2) * width for i, s in enumerate(scenarios) if s in mine]
        heights = [mine[s][value] for s in scenarios if s in mine]
        errors = None
        if value == "mean_cost":
            low = [max(mine[s][value] - mine[s]["ci95"][0], 0.0) for s in scenarios if s in mine]
            high = [max(mine[s]["ci95"][1] - mine[s][value], 0.0) for s in scenarios if s in mine]
            errors = [low, high]
        colour = STRATEGY_COLOURS.get(strategy, SKY)
        label = PAPER_NAMES.get(strategy, strategy)
        line = {"linewidth": 0.9, "ecolor": DARK if colour != DARK else GREY}  # seen on the bar and above it
        ax.bar(at, heights, width, yerr=errors, color=colour, label=label, error_kw=line)
    ax.set_xticks(range(len(scenarios)), [PAPER_TITLES.get(s, s) for s in scenarios], fontsize=8)
    ax.set_ylabel("mean cost, 95 % interval" if value == "mean_cost" else "share of trials done")
    ax.legend(fontsize=6.5, frameon=False, ncols=4, loc="upper center", bbox_to_anchor=(0.5, 1.16))
