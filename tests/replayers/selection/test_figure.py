"""The figure of a campaign: one trial, twins, scales, and a legend that names what is drawn and nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest
from known_costs import trial
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from replayers.selection import figure
from replayers.selection.trial_costs import TrialCosts
from replayers.selection.verdict import SelectionSettings, history

OPEN = trial([20, 15, 90], [20, 40, 95], estimate=[20, 30, 92])
"""a is exact and may cost 5 more than b; c is out by proof, by 50 or more."""


def drawn(
    monkeypatch: pytest.MonkeyPatch, trials: Sequence[TrialCosts], *, regrets: Sequence[float] = ()
) -> tuple[Figure, Axes, Axes]:
    verdicts = history(trials, SelectionSettings())
    if regrets:
        verdicts = tuple(replace(v, regret_so_far=r) for v, r in zip(verdicts, regrets, strict=True))
    kept: list[Figure] = []

    def keep(made: Figure, path: Path) -> Path:
        made.draw_without_rendering()
        kept.append(made)
        return path

    monkeypatch.setattr(figure, "save", keep)
    figure.draw_campaign(Path("figure.png"), verdicts, title="find $mug$")
    left, right = kept[0].axes
    return kept[0], left, right


def legend(ax: Axes) -> list[str]:
    found = ax.get_legend()
    assert found is not None
    return [text.get_text() for text in found.get_texts()]


def ticks(ax: Axes) -> list[str]:
    low, high = ax.get_xlim()
    shown = zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
    return [label.get_text() for at, label in shown if low <= at <= high]


def test_one_trial_has_one_tick_and_shows_its_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    _, left, right = drawn(monkeypatch, [OPEN])
    assert (ticks(left), ticks(right)) == (["1"], ["1"])
    bars = [path.vertices for bar in left.collections for path in bar.get_paths()]
    assert [sorted(np.asarray(bar)[:, 1]) for bar in bars] == [[20, 20], [15, 40], [90, 95]]
    assert len({round(float(np.asarray(bar)[0, 0]), 3) for bar in bars}) == 3  # side by side


def test_one_dot_a_strategy_that_is_out_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    _, left, _ = drawn(monkeypatch, [OPEN])
    assert [line.get_ydata() for line in left.lines if line.get_marker() == "o"] == [[92]]


def test_the_title_is_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    made, _, _ = drawn(monkeypatch, [OPEN, OPEN])
    assert made.get_suptitle() == "find $mug$, 2 trials: drive a next, not settled"


def test_the_legend_names_what_is_drawn_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    _, left, right = drawn(monkeypatch, [OPEN, OPEN])
    assert legend(left) == [
        "a: 20.0, drive next",
        "b: 30.0",
        "c: 92.0",
        "expected, given what was seen",
        "from lower to upper bound",
        "out by proof",
    ]
    assert legend(right) == ["on the trials so far, at most", "in the mean of trials to come: not known yet"]
    assert len(right.lines) == 1


def test_twins_share_a_line_and_its_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = trial([10, 10, 30], [10, 10, 30])
    _, left, _ = drawn(monkeypatch, [exact, exact])
    assert legend(left)[:2] == ["a = b: 10.0, drive next", "c: 30.0"]
    assert len([line for line in left.lines if line.get_linestyle() == "-"]) == 2


def test_a_missing_bound_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    _, left, right = drawn(monkeypatch, [trial([5, 10, 90], [inf, 20, 95], estimate=[6, 15, 92])])
    assert legend(left)[0] == "a: 6.0, drive next, no upper bound"
    assert legend(right)[0] == "on the trials so far: not known yet"


@pytest.mark.parametrize(
    ("regrets", "scale"), [((16.5, 21.2, 18.1), "linear"), ((1.2, 0.0, 160.0), "symlog"), ((0.0, 0.0), "linear")]
)
def test_regrets_of_one_order_are_on_a_linear_scale_below_the_top(
    monkeypatch: pytest.MonkeyPatch, regrets: Sequence[float], scale: str
) -> None:
    _, _, right = drawn(monkeypatch, [OPEN] * len(regrets), regrets=regrets)
    assert right.get_yscale() == scale
    low, high = right.get_ylim()
    assert low == 0
    assert max(regrets) * 1.1 < high
