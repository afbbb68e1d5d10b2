"""Figures of selection: regret and eliminations over the trials of a campaign, and selectors against each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from replayers.selection.elimination import NEAR, Floats
from replayers.selection.verdict import SelectionVerdict
from workbench.arrays import Bools
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
from workbench.terminal import counted
from workbench.tolerances import NEAR_SHOWN_COST

BLACK = "#000000"
APART = 0.6
"""How far the strategies of one trial stand apart in all, so that their bounds do not hide one another."""
LEGEND_TITLE = "strategy: its expected mean cost in trials to come"
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PINK, SKY, GREY)


def draw_campaign(path: Path, verdicts: Sequence[SelectionVerdict], *, title: str) -> Path:
    """Bounds of each strategy's mean cost over trials, with eliminations, beside the regret still possible.

    The title gives the answer after the last trial.
    """
    figure, axes = new_figure(10.0, 4.8, columns=2)
    _draw_standings(axes[0], verdicts)
    _draw_possible_regret(axes[1], verdicts)
    last = verdicts[-1]
    answer = f"drive {last.next} next, {f'settled {last.settled}' if last.settled else 'not settled'}"
    figure.suptitle(f"{title}, {counted(last.trials, 'trial')}: {answer}", fontsize=9, parse_math=False)
    return save(figure, path)


def _draw_standings(ax: Axes, verdicts: Sequence[SelectionVerdict]) -> None:
    """Expected mean cost of each strategy between its bounds; a dot where it is out by proof, a cross by sequence.

    Strategies that lie on one another share a line and its entry in the legend.
    """
    trials = np.array([v.trials for v in verdicts], dtype=float)
    alone, next_one = len(trials) == 1, verdicts[-1].next
    drawn, lines, signs = _drawn_strategies(verdicts), list[Artist](), dict[str, Artist]()
    for k, one in enumerate(drawn):
        colour, on_top = COLOURS[k % len(COLOURS)], next_one in one.names
        at = trials + (k - (len(drawn) - 1) / 2) * APART / len(drawn) if alone else trials
        if alone:
            ax.vlines(at, one.lower, one.upper, color=colour, alpha=0.4, linewidth=5)
        else:
            ax.fill_between(at, one.lower, one.upper, color=colour, alpha=0.15, linewidth=0)
        lines += ax.plot(
            at,
            one.expected,
            color=colour,
            linewidth=2.4 if on_top else 1.4,
            zorder=3 if on_top else 2,
            label=one.label(verdicts[-1]),
            marker="_" if alone else "",
            markersize=14,
            markeredgewidth=2,
        )
        for said, marker, out in (("out by proof", "o", one.by_proof), ("out by sequence", "x", one.by_sequence)):
            if out.any():
                ax.plot(at[out], one.expected[out], marker, color=colour, markersize=4, zorder=4)
                signs[said] = Line2D([], [], color=GREY, marker=marker, markersize=4, linestyle="none", label=said)
    guessed = any(s.middles for s in verdicts[-1].standings)
    said = "middle of the bounds, where nothing was drawn" if guessed else "expected, given what was seen"
    middle = Line2D([], [], color=GREY, label=said)
    band = Patch(color=GREY, alpha=0.3, linewidth=0, label="from lower to upper bound")
    ax.set_ylabel("mean cost a trial, so far")
    _finish(ax, verdicts, [*lines, middle, band, *signs.values()], title=LEGEND_TITLE, columns=2)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Drawn:
    """Strategies that are drawn as one, since they never differ; every array has shape (trials,)."""

    names: tuple[str, ...]
    lower: Floats
    upper: Floats
    expected: Floats
    by_proof: Bools
    by_sequence: Bools
    bounded: bool

    def looks_like(self, other: _Drawn) -> bool:
        pairs = ((getattr(self, field), getattr(other, field)) for field in ("lower", "upper", "expected"))
        same_signs = (self.by_proof == other.by_proof).all() and (self.by_sequence == other.by_sequence).all()
        return bool(same_signs) and all(np.allclose(a, b, rtol=0, atol=NEAR_SHOWN_COST) for a, b in pairs)

    def label(self, last: SelectionVerdict) -> str:
        to_come = dict.fromkeys(f"{s.to_come:.1f}" for s in last.standings if s.strategy in self.names)
        words = [f"{' = '.join(self.names)}: {' and '.join(to_come)}"]
        words += ["drive next"] if last.next in self.names else []
        return ", ".join(words if self.bounded else [*words, "no upper bound"])


def _drawn_strategies(verdicts: Sequence[SelectionVerdict]) -> list[_Drawn]:
    drawn: list[_Drawn] = []
    for k, name in enumerate(s.strategy for s in verdicts[0].standings):
        rows = [v.standings[k] for v in verdicts]
        expected, upper = np.array([r.expected for r in rows]), np.array([r.upper for r in rows])
        proved, found = ([name in {e.strategy for e in out} for out in outs] for outs in (
            [v.by_proof for v in verdicts], [v.by_sequence for v in verdicts]))  # fmt: skip
        one = _Drawn(
            names=(name,),
            lower=np.array([r.lower for r in rows]),
            upper=np.where(np.isfinite(upper), upper, expected),
            expected=expected,
            by_proof=np.array(proved),
            by_sequence=np.array(found),
            bounded=bool(np.isfinite(upper[-1])),
        )
        twin = next((i for i, other in enumerate(drawn) if one.looks_like(other)), None)
        if twin is None:
            drawn.append(one)
        else:
            drawn[twin] = replace(drawn[twin], names=(*drawn[twin].names, name))
    return drawn


def _draw_possible_regret(ax: Axes, verdicts: Sequence[SelectionVerdict]) -> None:
    trials = [v.trials for v in verdicts]
    so_far = np.array([v.regret_so_far if np.isfinite(v.regret_so_far) else np.nan for v in verdicts])
    known = [v.regret_to_come < v.regret_to_come_unknown - NEAR for v in verdicts]
    to_come = np.array([v.regret_to_come if k else np.nan for v, k in zip(verdicts, known, strict=True)])
    handles: list[Artist] = []
    for values, colour, said in (
        (so_far, BLUE, "on the trials so far"),
        (to_come, ORANGE, "in the mean of trials to come"),
    ):
        if np.isfinite(values).any():
            handles += ax.plot(trials, values, color=colour, marker=".", label=f"{said}, at most", clip_on=False)
        else:
            handles.append(Line2D([], [], linestyle="none", label=f"{said}: not known yet"))
    _scale_from_zero(ax, np.concatenate([so_far, to_come]))
    ax.set_ylabel("regret of the strategy to drive next, a trial")
    _finish(ax, verdicts, handles)


def _scale_from_zero(ax: Axes, values: Floats) -> None:
    """From 0 to above the greatest value: linear where the values are of one order, logarithmic otherwise."""
    positive = values[np.isfinite(values) & (values > 0)]
    most = float(positive.max(initial=0.0))
    if most > 10 * max(1.0, float(positive.min(initial=most))):
        ax.set_yscale("symlog", linthresh=1.0)
        ax.yaxis.set_major_formatter("{x:g}")
        ax.set_ylim(0, 2 * most)
    else:
        ax.set_ylim(0, 1.15 * most or 1.0)


def _finish(
    ax: Axes, verdicts: Sequence[SelectionVerdict], handles: Sequence[Artist], *, title: str = "", columns: int = 1
) -> None:
    """Trials as whole numbers from the first to the last, and the legend below, where it hides nothing."""
    ax.set_xlabel("trials")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    if len(verdicts) == 1:
        ax.set_xlim(verdicts[0].trials - APART, verdicts[0].trials + APART)
    ax.legend(handles=list(handles), title=title or None, title_fontsize=7, fontsize=7, frameon=False, ncols=columns,
              loc="upper left", bbox_to_anchor=(0, -0.14), borderaxespad=0, alignment="left")  # fmt: skip
    disable_math_text(ax)


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
