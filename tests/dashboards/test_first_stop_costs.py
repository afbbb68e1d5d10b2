"""Expected costs of looking elsewhere first, and what the panels say about finds and alternatives."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE
from toy_run import empty_run, ns, other_run, toy_run

from dashboards.model.clock import Clock
from dashboards.model.containers.unopened import unopened
from dashboards.model.first_stop_costs import first_looks
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.panels.find_costs import find_costs
from dashboards.panels.now import RunLegend, legend
from dashboards.panels.plan import plan
from dashboards.panels.plots import cost_plot, plots, remaining_plot

OURS, OTHER, EMPTY = timeline_of(toy_run()), timeline_of(other_run()), timeline_of(empty_run())


def test_each_first_look_has_the_cost_of_its_whole_search() -> None:
    """From the fridge, counter first: 1 + 0.3 (5 + 2) + 0.7 (7 + 0.1 (5 + 7)) = 8.84; desk first: 17.39."""
    looks = first_looks(OURS, OURS.decisions[1])
    assert [look.container for look in looks] == [COUNTER, DESK]
    assert [look.cost for look in looks] == pytest.approx([8.84, 17.39])
    assert [look.chosen for look in looks] == [True, False]


def test_first_looks_are_priced_under_the_belief_model_of_the_decision() -> None:
    """Marginal, 0.3 and 0.1 become 0.75 and 0.25: counter first: 1 + 0.75 (5 + 2) + 0.25 (7 + 5 + 7) = 11."""
    table = OURS.decisions[0].find_costs
    assert table is not None
    costs = msgspec.structs.replace(table, belief_model="marginal")
    looks = first_looks(timeline_of(toy_run()), replace(OURS.decisions[1], find_costs=costs))
    assert looks[0].container == COUNTER
    assert looks[0].cost == pytest.approx(11.0)


def test_a_decision_without_a_search_has_no_first_looks() -> None:
    assert first_looks(OURS, OURS.decisions[2]) == ()


def test_the_panel_says_why_a_first_look_was_not_taken() -> None:
    scene = scene_at(OURS, ns(4.5))
    words = find_costs(scene, FRIDGE, first_looks(OURS, OURS.decisions[1]))
    assert "<b>taken</b>" in words
    assert "8.6 more expensive" in words


def test_the_panel_says_why_a_find_is_not_in_the_plan() -> None:
    words = find_costs(scene_at(OURS, ns(1)), "start")
    assert "<b>yes</b>" in words
    assert "no, to start instead (6.0 cheaper)" in words


def test_ways_to_begin_say_what_stands_against_them() -> None:
    assert "farther" in plan(scene_at(OURS, ns(1)))


def test_remaining_cost_falls_by_what_was_spent_and_never_below_nothing() -> None:
    """Decision 1 expects 12 and the way to the fridge costs 1; the third expects 7 and all of it is spent."""
    from dashboards.panels.plots import _remaining

    points = _remaining(OURS, Clock(timelines=(OURS,)), 0)
    assert points[:2] == [(0.0, 12.0), (2.0, 11.0)]
    assert points[-1][1] == 0.0
    assert min(y for _, y in points) >= 0.0
    assert "Expected remaining cost" in remaining_plot(Clock(timelines=(OURS,)), ["lios"])
    assert "No plan said" in remaining_plot(Clock(timelines=(EMPTY,)), ["lios"])


def test_assumed_stretches_of_cost_are_dashed() -> None:
    clock = Clock(timelines=(OURS, OTHER))
    assert "stroke-dasharray" in cost_plot(clock, ["lios", "greedy"])
    assert "stroke-dasharray" not in cost_plot(Clock(timelines=(OURS,)), ["lios"])
    assert plots(clock, ["lios", "greedy"], "Mug").count("<svg") == 3


def test_containers_that_no_run_opened_are_known_where_a_replay_is_shown() -> None:
    ids = [c.id for c in OURS.plan.containers] if OURS.plan is not None else []
    closed = {ids[i] for i in np.flatnonzero(unopened((OURS, OTHER)))}
    assert closed == {BED, DESK}
    assert not unopened((OURS,)).any(), "of one run the colours tell the same"
    assert unopened(()).shape == (0,)
    assert TABLE not in closed
    assert "nobody opened it" in legend(scene_at(OURS, ns(1)), RunLegend(unopened=True))
    assert "nobody opened it" not in legend(scene_at(OURS, ns(1)))
