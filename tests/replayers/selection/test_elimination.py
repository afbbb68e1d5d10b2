"""Eliminations: by proof never the best of the trials so far; by sequence only with evidence."""

from __future__ import annotations

import numpy as np
from known_costs import drawn_trial, trial

from replayers.selection.elimination import (
    eliminated_by_proof,
    eliminated_by_sequence,
    min_difference,
    min_mean_difference,
)


def test_proof_needs_the_sums_apart_in_every_world() -> None:
    near = trial([10, 11, 40], [10, 30, 60])
    out = {e.strategy: e for e in eliminated_by_proof([near])}
    assert set(out) == {"b", "c"}
    assert (out["c"].by, out["c"].margin) == ("a", 30)
    far = trial([35, 10, 10], [35, 14, 30])
    assert {e.strategy for e in eliminated_by_proof([near, far])} == {"a", "c"}  # a 45, b 21..44, c 50..90


def test_differences_world_by_world_prove_more_than_sums() -> None:
    apart = np.array([[0.0, -2.0], [6.0, 0.0]])  # a costs 2 to 6 less in every world, though the bounds overlap
    both = trial([10, 12], [30, 34], max_difference=apart)
    assert [(e.strategy, e.by, e.margin) for e in eliminated_by_proof([both])] == [("b", "a", 2.0)]


def test_the_best_so_far_is_never_out_by_proof() -> None:
    out = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        drawn = [drawn_trial(rng) for _ in range(6)]
        for t in range(1, 7):
            totals = np.sum([true for _, true in drawn[:t]], axis=0)
            gone = {e.strategy for e in eliminated_by_proof([seen for seen, _ in drawn[:t]])}
            assert "abc"[int(totals.argmin())] not in gone
            out += len(gone)
    assert out > 300


def test_sequences_need_many_trials_and_find_a_clear_difference() -> None:
    clear = trial([10, 40, 10], [10, 40, 10])
    assert eliminated_by_sequence([clear] * 3) == ()
    assert {e.strategy for e in eliminated_by_sequence([clear] * 120)} == {"b"}


def test_what_nobody_saw_is_no_evidence() -> None:
    unseen = trial([0, 0, 0], [float("inf")] * 3)
    assert eliminated_by_sequence([unseen] * 200) == ()
    assert (min_mean_difference([unseen] * 200) <= 0).all()


def test_costs_above_the_failure_cost_count_as_it() -> None:
    dear = trial([10, 500, 0], [10, 700, 0], limit=100.0)
    assert min_difference(dear, 1, 0) == 90
    assert min_difference(dear, 0, 1) == -90
