"""Verdicts after each trial: regret that is possible, and when the answer is settled."""

from __future__ import annotations

from math import inf

import pytest
from known_costs import trial

from replayers.selection.verdict import SelectionSettings, history, verdict_after

CLEAR = trial([10, 40, 60], [10, 45, 90], estimate=[10, 42, 70])


def test_possible_regret_is_the_greatest_difference_to_any_other() -> None:
    after = verdict_after([trial([20, 15, 90], [20, 40, 95], estimate=[20, 30, 92])], SelectionSettings())
    assert (after.next, after.regret_so_far) == ("a", 5.0)


def test_no_regret_where_proof_leaves_one() -> None:
    after = verdict_after([CLEAR], SelectionSettings())
    assert (after.next, after.regret_so_far, after.settled) == ("a", 0.0, "")
    assert {e.strategy for e in after.by_proof} == {"b", "c"}


def test_unknown_upper_bounds_leave_the_regret_unknown() -> None:
    after = verdict_after([trial([5, 10, 90], [inf, 20, 95], estimate=[6, 15, 92])], SelectionSettings())
    assert (after.next, after.regret_so_far) == ("a", inf)


def test_many_trials_settle_by_sequence_and_some_say_how_many_are_missing() -> None:
    few = verdict_after([CLEAR] * 10, SelectionSettings())
    assert few.settled == ""
    assert few.trials_to_settle is not None
    assert few.trials_to_settle > 0
    assert verdict_after([CLEAR] * 150, SelectionSettings()).settled == "by sequence"


@pytest.mark.parametrize(("horizon", "settled"), [(10, "by proof"), (14, "")])
def test_a_horizon_settles_by_proof_once_the_lead_cannot_be_made_up(horizon: int, settled: str) -> None:
    after = verdict_after([CLEAR] * 9, SelectionSettings(horizon=horizon))  # ahead by 270; a trial can bring 100
    assert after.settled == settled


def test_strategies_that_are_alike_are_told() -> None:
    exact = trial([10, 10, 30], [10, 10, 30])
    assert verdict_after([exact], SelectionSettings()).same == ("b",)


def test_history_is_what_was_known_after_each_trial() -> None:
    assert [v.trials for v in history([CLEAR, CLEAR], SelectionSettings())] == [1, 2]
