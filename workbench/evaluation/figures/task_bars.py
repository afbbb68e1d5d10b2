"""Bar charts of the cost and success of each strategy in each scenario, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count
from types import MappingProxyType
from typing import Any

from matplotlib.axes import Axes

from workbench.evaluation.figures.style import BLUE, GREEN, GREY, ORANGE, PINK, SKY, VERMILION, disable_math_text
from workbench.evaluation.tasks.names import scenario_title, shortened, strategy_title

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

OTHER_COLOURS = (SKY, "#F0E442", "#882255", "#999933", "#332288", "#88CCEE")
HATCHES = ("", "////", "....", "xxxx", "oo")
"""Colours of strategies outside the table: six colours, then the same ones hatched."""

MAX_UPRIGHT_LABELS = 6
"""With more scenarios than this, their names are rotated."""


def draw_task_bars(ax: Axes, lines: Sequence[Mapping[str, Any]], *, value: str = "mean_cost") -> None:
    """Draw groups of bars, one group per scenario.

    Args:
        lines: rows of task_table.table.
        value: mean_cost (with its interval) or success_rate.
    """
    scenarios = list(dict.fromkeys(line["scenario"] for line in lines))
    strategies = list(dict.fromkeys(line["strategy"] for line in lines))
    looks = strategy_styles(strategies)
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
        colour, hatch = looks[strategy]
        label = shortened(strategy_title(strategy), 30)
        line = {"linewidth": 0.9, "ecolor": DARK if colour != DARK else GREY}  # visible on the bar and above it
        bars = ax.bar(at, heights, width, yerr=errors, color=colour, label=label, error_kw=line, hatch=hatch)
        for bar in bars:
            bar.set(edgecolor="white", linewidth=0.4)
    crowded = len(scenarios) > MAX_UPRIGHT_LABELS
    max_chars = 24 if crowded else max(90 // max(len(scenarios), 1), 16)
    ax.set_xticks(range(len(scenarios)), [shortened(scenario_title(s), max_chars) for s in scenarios], fontsize=8)
    if crowded:
        ax.tick_params(axis="x", labelrotation=25)
        for label in ax.get_xticklabels():
            label.set(ha="right", rotation_mode="anchor")
    drew = " or ".join(dict.fromkeys(line.get("ci95_resamples", "houses") for line in lines))
    ax.set_ylabel(f"mean cost, 95 % interval over {drew}" if value == "mean_cost" else "share of trials done")
    ax.legend(fontsize=6.5, frameon=False, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    disable_math_text(ax)


def strategy_styles(strategies: Sequence[str]) -> dict[str, tuple[str, str]]:
    """A unique colour and hatch for each strategy: NAME@SOLVER is hatched in the colour of NAME, others cycle."""
    looks: dict[str, tuple[str, str]] = {}
    for strategy in strategies:
        base = strategy.partition("@")[0]
        known = STRATEGY_COLOURS.get(base)
        if strategy in STRATEGY_COLOURS:
            looks[strategy] = (STRATEGY_COLOURS[strategy], "")
            continue
        colours = (known,) if known else OTHER_COLOURS
        hatches = HATCHES[1:] if known else HATCHES
        turns = ((colour, hatch * more) for more in count(1) for hatch in hatches for colour in colours)
        looks[strategy] = next(look for look in turns if look not in looks.values())
    return looks
