"""Scenes of a run worked out by hand: robot, belief, action; for seeks in any order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy import BED, COUNTER, FRIDGE, TABLE
from toy_run import empty_run, ns, other_run, toy_run

from dashboards.model.scene import STATUSES, Scene, scene_at
from dashboards.model.timeline import Timeline, timeline_of

TIMELINE = timeline_of(toy_run())
INDEX = {c.id: i for i, c in enumerate(TIMELINE.plan.containers)} if TIMELINE.plan else {}


def at(second: float, timeline: Timeline = TIMELINE) -> Scene:
    return scene_at(timeline, ns(second))


def test_the_robot_is_half_way_after_half_the_time() -> None:
    scene = at(1.0)
    assert (scene.robot.x_m, scene.robot.y_m) == pytest.approx((1.0, 2.5))
    assert scene.robot.yaw_rad == pytest.approx(np.pi / 2)
    assert scene.travel_m == pytest.approx(0.5)
    assert scene.trail.tolist() == [[1.0, 2.0], [1.0, 2.0], [1.0, 2.5]]


def test_it_faces_the_container_once_it_stands_there() -> None:
    assert at(3.0).robot.yaw_rad == pytest.approx(3.0)


def test_costs_grow_along_a_move_and_stand_during_a_search() -> None:
    assert [at(s).cost for s in (0.0, 1.0, 3.0, 4.5, 12.0, 15.0)] == pytest.approx([0.0, 0.5, 1.0, 1.75, 7.5, 9.5])


def test_a_container_is_searched_from_the_moment_it_was_seen() -> None:
    before, after = at(3.999), at(4.0)
    fridge = INDEX[FRIDGE]
    assert STATUSES[before.status[fridge]] == "unsearched"
    assert STATUSES[after.status[fridge]] == "searched"
    assert before.belief[fridge] == pytest.approx(0.4)
    assert np.isnan(after.belief[fridge])
    assert STATUSES[before.status[INDEX[TABLE]]] == "known"
    assert (before.searches, after.searches, at(15).searches) == (0, 1, 2)


def test_what_was_sought_is_marked_where_it_was_seen() -> None:
    assert not at(6.9).holds_focus.any()
    assert np.flatnonzero(at(7.0).holds_focus).tolist() == [INDEX[COUNTER]]


def test_decisions_take_force_at_their_stamps() -> None:
    assert [at(s).decision for s in (0.0, 3.999, 4.0, 7.0, 15.0)] == [1, 1, 2, 3, 3]
    assert at(1.0).order[INDEX[FRIDGE]] == 1
    assert at(4.0).order[INDEX[COUNTER]] == 1
    assert at(4.0).order[INDEX[FRIDGE]] == 0


def test_the_plan_knows_what_is_done_and_what_comes() -> None:
    assert [s.progress for s in at(1.0).steps] == ["current"]
    assert [s.progress for s in at(8.0).steps] == ["current", "next"]
    assert [s.progress for s in at(12.5).steps] == ["done", "current"]
    assert [s.progress for s in at(15.0).steps] == ["done", "done"]


def test_the_hand_is_empty_until_the_pick_ends() -> None:
    assert at(11.9).robot.holding is None
    assert at(12.0).robot.holding == "Mug"


def test_phases_name_what_goes_on() -> None:
    assert [at(s).phase for s in (1.0, 3.0, 8.0, 13.0)] == ["moving", "searching", "manipulating", "moving"]
    assert at(3.0).doing == "search fridge 1"
    assert at(15.0).outcome == "done"


def test_the_way_ahead_begins_at_the_robot_and_ends_where_the_plan_ends() -> None:
    ahead = at(1.0).ahead
    assert ahead[0].tolist() == pytest.approx([1.0, 2.5])
    assert [1.0, 3.0] in ahead.tolist()
    assert ahead[-1].tolist() == pytest.approx([1.0, 2.0])
    assert at(15.0).ahead.tolist() == [[1.0, 2.0]]


def test_focus_can_be_chosen() -> None:
    assert scene_at(TIMELINE, ns(1.0), focus="Plate").belief[INDEX[FRIDGE]] == pytest.approx(0.1)
    assert scene_at(TIMELINE, ns(1.0), focus="no such type").focus == "Mug"


def test_a_replay_marks_what_nobody_opened_and_what_it_assumed() -> None:
    timeline = timeline_of(other_run())
    assert not at(8.9, timeline).unseen.any()
    assert np.flatnonzero(at(9.0, timeline).unseen).tolist() == [INDEX[BED]]
    assert at(6.0, timeline).imputed.tolist()[-1]
    assert not at(1.0, timeline).imputed.any()


def test_a_log_that_was_cut_off_at_once_stands_still() -> None:
    timeline = timeline_of(empty_run())
    scene = at(100.0, timeline)
    assert (scene.robot.x_m, scene.robot.y_m) == (1.0, 2.0)
    assert (scene.decision, scene.decisions, scene.focus) == (0, 0, "")
    assert scene.ahead.shape == (0, 2)


def test_beyond_its_ends_a_run_stands_still() -> None:
    assert at(-5.0).second == 0.0
    assert at(999.0).second == 15.0


@given(st.lists(st.floats(0, 15), min_size=1, max_size=8))
def test_a_moment_looks_the_same_whatever_was_shown_before(seconds: list[float]) -> None:
    alone = scene_at(timeline_of(toy_run()), ns(seconds[-1]))
    for second in seconds:
        last = at(second)
    assert np.array_equal(last.trail, alone.trail)
    assert np.array_equal(last.belief, alone.belief, equal_nan=True)
    assert (last.cost, last.decision, last.doing) == (alone.cost, alone.decision, alone.doing)


@given(st.floats(0, 14.9), st.floats(0, 0.1))
def test_costs_and_ways_never_shrink(second: float, more: float) -> None:
    before, after = at(second), at(second + more)
    assert after.cost >= before.cost
    assert after.travel_m >= before.travel_m - 1e-9
    assert after.searches >= before.searches
