"""Labels of a time axis do not overlap, whether decisions take a millisecond or a minute."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from workbench.evaluation.figures.planning_time import draw_planning_time


@pytest.mark.parametrize("longest_s", [3e-3, 0.05, 2.0, 60.0])
def test_labels_do_not_touch(longest_s: float) -> None:
    figure = Figure(figsize=(4.2, 3.0))
    ax = figure.add_subplot()
    draw_planning_time(ax, {"deliver-3": np.geomspace(2e-4, longest_s, 50)})
    figure.canvas.draw()
    ticks = [t for t in ax.xaxis.get_major_ticks() if ax.viewLim.x0 <= t.get_loc() <= ax.viewLim.x1]
    boxes = [tick.label1.get_window_extent() for tick in ticks]
    assert len(boxes) >= 3
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_a_figure_of_no_decision_is_drawn() -> None:
    ax = Figure().add_subplot()
    draw_planning_time(ax, {"deliver-3": np.zeros(0)})
    assert not ax.lines
    assert "no decision" in ax.texts[0].get_text()
