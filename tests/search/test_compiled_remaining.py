"""Probabilities of a missing object after every subset: the compiled loops equal the numpy reference."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.search import compiled_remaining, corrected, remaining
from workbench.search.remaining import BELIEF_MODELS, KINDS
from workbench.search.ties import ranked

chances = st.one_of(st.sampled_from([0.0, 1e-12, 1e-6, 0.5, 1.0]), st.floats(0.0, 1.0))


@settings(max_examples=80, deadline=None)
@given(st.data(), st.integers(1, 3), st.integers(1, 9))
def test_compiled_is_numpy(data: st.DataObject, items: int, containers: int) -> None:
    rows = st.lists(chances, min_size=containers, max_size=containers)
    p = np.array([data.draw(rows) for _ in range(items)])
    kept = data.draw(st.integers(1, min(containers, 6)))
    order = data.draw(st.permutations(range(containers)))
    candidates = np.tile(np.sort(np.array(order[:kept], dtype=np.intp)), (items, 1))
    for model in BELIEF_MODELS:
        w = remaining.weights(p, model)
        ours = compiled_remaining.missing_by_subset(w, candidates, KINDS[model])
        theirs = remaining.missing_by_subset(w, candidates, model)
        assert np.allclose(ours, theirs, rtol=1e-10, atol=1e-13, equal_nan=True), model
    some = p[(p > 0).any(axis=1)]
    assert np.allclose(
        compiled_remaining.chance_of_any(some), remaining.existence_probability(some), rtol=1e-8, atol=1e-8
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(2, 9))
def test_the_order_of_the_others_is_numpys(seed: int, items: int, containers: int) -> None:
    rng = np.random.default_rng(seed)
    p, between_m = rng.integers(0, 3, (items, containers)) / 4, rng.integers(0, 4, (containers, containers)) * 1.0
    searched = np.argsort(rng.random((items, containers)), axis=1)[:, : rng.integers(1, containers)]
    from_m = between_m[searched].mean(axis=1)
    ours = compiled_remaining.non_candidate_order(p, searched, from_m, between_m)
    assert (ours == corrected.non_candidate_order(p, searched, from_m, between_m)).all(), "ties too go to the earlier"


@settings(max_examples=80, deadline=None)
@given(st.data(), st.integers(1, 3), st.integers(1, 9))
def test_what_is_unconditioned_is_numpys(data: st.DataObject, items: int, containers: int) -> None:
    p = np.array([data.draw(st.lists(chances, min_size=containers, max_size=containers)) for _ in range(items)])
    ours = remaining.unconditioned(p, "marginal")
    some = np.where((p > 0).any(axis=1, keepdims=True), p, remaining.UNIFORM_PROBABILITY)
    z = np.maximum(remaining.existence_probability(some), remaining.MIN_EXISTENCE_PROBABILITY)
    assert np.allclose(ours, some * z, rtol=1e-8, atol=1e-8)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 9))
def test_the_greatest_are_numpys_ties_too(seed: int, rows: int, columns: int) -> None:
    rng = np.random.default_rng(seed)
    scores = rng.integers(0, 3, (rows, columns)) / 4 - 0.25 + rng.choice([0.0, 1e-12, 4e-10], (rows, columns))
    count = int(rng.integers(1, columns + 1))
    assert (compiled_remaining.greatest(scores, count) == np.sort(ranked(scores, count), axis=1)).all()


def test_without_numba_the_readable_one_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    p, candidates = np.array([[0.2, 0.7, 0.4]]), np.array([[0, 1]])
    compiled = {m: remaining.still_missing_by_subset(p, candidates, m) for m in BELIEF_MODELS}
    monkeypatch.setattr(remaining, "compiled_loops", lambda: None)
    for model in BELIEF_MODELS:
        assert np.allclose(remaining.still_missing_by_subset(p, candidates, model), compiled[model], atol=1e-12)
