"""Figures of selection: regret and eliminations over the trials of a campaign, and selectors against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from replayers.selection.elimination import NEAR, Floats
from replayers.selection.verdict import SelectionVerdict
from workbench.evaluation.figures.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PINK,
    SKY,
    VERMILION,
    disable_math_text,
    new_figure,
    save,
)

BLACK = "#000000"
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PINK, SKY, GREY)


def draw_campaign(path: Path, verdicts: Sequence[SelectionVerdict], *, title: str) -> Path:
    """Bounds of each strategy's mean cost over trials, with eliminations, beside the regret still possible."""
    figure, axes = new_figure(10.0, 4.0, columns=2)
    _draw_standings(axes[0], verdicts)
    _draw_possible_regret(axes[1], verdicts)
    figure.suptitle(title, fontsize=9, parse_math=False)
    return save(figure, path)


def _draw_standings(ax: Axes, verdicts: Sequence[SelectionVerdict]) -> None:
    """One band a strategy, from its lower to its upper mean; a dot where it is out by proof, a cross by sequence."""
    trials = np.array([v.trials for v in verdicts])
    for k, name in enumerate(s.strategy for s in verdicts[0].standings):
        colour = COLOURS[k % len(COLOURS)]
        rows = [v.standings[k] for v in verdicts]
        expected = np.array([r.expected for r in rows])
        ends = [np.array([getattr(r, end) for r in rows]) for end in ("lower", "upper")]
        ends[1] = np.where(np.isfinite(ends[1]), ends[1], expected)
        ax.fill_between(trials, ends[0], ends[1], color=colour, alpha=0.15, linewidth=0)
        ax.plot(trials, expected, color=colour, linewidth=1.4, label=name, marker="." if len(trials) == 1 else None)
        for by, marker, said in (("by_proof", "o", "proof"), ("by_sequence", "x", "sequence")):
            out = np.array([any(e.strategy == name for e in getattr(v, by)) for v in verdicts])
            ax.plot(trials[out], expected[out], marker, color=colour, markersize=4, gid=f"{said} {name}")
    ax.set(xlabel="trials (dot: out by proof, cross: by sequence)", ylabel="mean cost, from bound to bound")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.legend(fontsize=7, frameon=False)
    disable_math_text(ax)


def _draw_possible_regret(ax: Axes, verdicts: Sequence[SelectionVerdict]) -> None:
    trials = [v.trials for v in verdicts]
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    so_far = [v.regret_so_far if np.isfinite(v.regret_so_far) else np.nan for v in verdicts]
    ax.plot(trials, so_far, color=BLUE, marker=".", linewidth=1.4, label="on the trials so far, at most")
    to_come = [v.regret_to_come if v.regret_to_come < v.regret_to_come_unknown - NEAR else np.nan for v in verdicts]
    ax.plot(trials, to_come, color=ORANGE, marker=".", linewidth=1.4, label="in the mean of coming trials, at most")
    ax.set_yscale("symlog", linthresh=1.0)
    ax.set_ylim(bottom=0)
    ax.set(xlabel="trials", ylabel="regret of the strategy to drive next, a trial")
    ax.legend(fontsize=7, frameon=False)


def draw_regrets(path: Path, regrets: Mapping[str, Floats], *, references: Sequence[str] = ()) -> Path:
    """Mean cumulative regret over trials, one line a selector, with the middle 80 % of the seeds of the first.

    Args:
        regrets: per selector, shape (seeds, trials).
        references: selectors that are no competitors; black and dashed, with their names in brackets.
    """
    figure, axes = new_figure(6.0, 4.0)
    ax = axes[0]
    for k, (name, table) in enumerate(regrets.items()):
        trials = np.arange(1, table.shape[1] + 1)
        told = name in references
        colour = BLACK if told else COLOURS[k % len(COLOURS)]
        if k == 0:
            low, high = np.quantile(table, [0.1, 0.9], axis=0)
            ax.fill_between(trials, low, high, color=colour, alpha=0.15, linewidth=0)
        ax.plot(
            trials,
            table.mean(axis=0),
            color=colour,
            linewidth=1.4,
            linestyle="--" if told else "-",
            label=f"({name})" if told else name,
        )
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set(xlabel="trials", ylabel="cumulative regret, mean over seeds")
    ax.legend(fontsize=7, frameon=False)
    return save(figure, path)
