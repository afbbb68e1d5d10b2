"""What is left of a belief where looks may have missed the item, by hand: in scene, bars, words and tables."""

from __future__ import annotations

import numpy as np
import pytest
from test_fruitless_looks import INDEX, missing
from toy import COUNTER, DESK, FRIDGE
from toy_run import ns, toy_run

from dashboards.model.containers.container_style import BAR_M, bar_heights_m, left_labels
from dashboards.model.perception.belief_after_misses import can_miss, left_after_misses
from dashboards.model.scene import Scene, scene_at
from dashboards.model.timeline import Timeline, timeline_of
from dashboards.panels.beliefs import beliefs
from dashboards.panels.now import legend, run_signs


def at(timeline: Timeline, second: float) -> Scene:
    return scene_at(timeline, ns(second), focus="Mug")


def test_it_is_what_bayes_leaves_from_the_look_on() -> None:
    """0.3 x 0.2 / (0.3 x 0.2 + 0.7) after the first look, 0.012 / 0.712 after the second."""
    timeline = missing((7, COUNTER, ()), (9, COUNTER, ()))
    left = [float(at(timeline, s).left[INDEX[COUNTER]]) for s in (6.9, 7.0, 9.0)]
    assert np.isnan(left[0])
    assert left[1:] == pytest.approx([0.06 / 0.76, 0.012 / 0.712])
    assert np.isnan(at(timeline, 9.0).left[INDEX[FRIDGE]]), "that look shows everything"


def test_a_later_decision_that_counts_the_container_is_believed() -> None:
    """A look at 2 s leaves 0.1 x 0.2 / (0.02 + 0.9); the decision at 4 s believes 0.1 of the desk."""
    timeline = missing((2, DESK, ()))
    assert at(timeline, 3.0).left[INDEX[DESK]] == pytest.approx(0.02 / 0.92)
    assert at(timeline, 4.0).left[INDEX[DESK]] == pytest.approx(0.1)


def test_nothing_is_left_over_where_the_item_was_found() -> None:
    timeline = missing((7, COUNTER, ()), (9, COUNTER, ("Mug",)))
    before, after = at(timeline, 8.0), at(timeline, 9.0)
    assert (before.holds_focus[INDEX[COUNTER]], after.holds_focus[INDEX[COUNTER]]) == (False, True)
    assert np.isnan(after.left).all()


def test_logs_whose_looks_show_everything_have_none_of_it() -> None:
    timeline = timeline_of(toy_run())
    assert not can_miss(timeline)
    assert np.isnan(left_after_misses(timeline, "Mug", timeline.end_ns)).all()
    assert "perhaps missed" not in legend(at(timeline, 8.0), run_signs([timeline]))


def test_bar_words_table_and_legend_say_it() -> None:
    timeline = missing((7, COUNTER, ()))
    scene = at(timeline, 8.0)
    assert bar_heights_m(scene)[INDEX[COUNTER]] == pytest.approx(0.06 / 0.76 / scene.top_belief * BAR_M)
    assert left_labels(scene) == ((INDEX[COUNTER], "7.9 % left"),)
    assert "7.9 % left" in beliefs(scene, timeline)
    assert "perhaps missed" in legend(scene, run_signs([timeline]))
