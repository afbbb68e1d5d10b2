"""Equal costs: the first in a fixed order is taken, in numpy and compiled, whatever the last bits say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.beliefs.belief import Belief
from workbench.search import compiled, corrected, reference
from workbench.search.candidates import choose
from workbench.search.compiled_remaining import non_candidate_order
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.policies.registry import POLICIES, policy
from workbench.search.policy import SearchQuery, first_stop
from workbench.search.remaining import BELIEF_MODELS, still_missing_by_subset
from workbench.search.ties import by_cost, first_least, first_of_least, ranked, tolerance
from workbench.tolerances import RELATIVE
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG = ItemType("Mug")
BIT = 1e-12


def test_the_first_of_equal_costs_is_taken_and_a_chain_of_near_ties_does_not_drift() -> None:
    assert first_least([3.0, 2.0 + BIT, 2.0, 2.0]) == 1
    step = 0.6 * RELATIVE * 100
    chain = [100.0 + 2 * step, 100.0 + step, 100.0]
    assert first_least(chain) == 1, "the first is beyond the tolerance of the least, though not of its neighbour"
    assert first_least([np.inf, np.inf]) == 0
    assert first_least([np.inf, 5.0]) == 1
    assert first_least([1.0 + 5e-8, 1.0], scale=100.0) == 0, "parts are measured by the whole"
    assert first_of_least(["b", "a"], {"a": 1.0, "b": 1.0 + BIT}.__getitem__) == "b"
    assert by_cost(["c", "b", "a"], {"a": 2.0, "b": 1.0 + BIT, "c": 1.0}.__getitem__) == ["c", "b", "a"]
    assert by_cost([1.0, np.inf, 0.5], float) == [0.5, 1.0, np.inf]
    assert ranked(np.array([[-np.inf, 1.0, np.inf, -np.inf, np.inf, 1e300, -1e300]])).tolist() == [
        [2, 4, 5, 1, 6, 0, 3]
    ]
    assert tolerance(0.5) == RELATIVE
    assert tolerance(-200.0) == pytest.approx(200 * RELATIVE)


def test_ranks_of_a_row_by_hand() -> None:
    scores = np.array([[0.2, 0.5 - BIT, 0.5, 0.2 + BIT], [0.1, 0.2, 0.3, 0.4]])
    assert ranked(scores).tolist() == [[1, 2, 0, 3], [3, 2, 1, 0]]
    assert ranked(scores, 2).tolist() == [[1, 2], [3, 2]]
    small = np.array([[1e-12, 3e-12, 2e-12]])
    assert ranked(small).tolist() == [[0, 1, 2]]
    assert ranked(small, min_scale=0.0).tolist() == [[1, 2, 0]]


@given(st.lists(st.integers(0, 4), min_size=1, max_size=9), st.integers(0, 2**32 - 1))
def test_ranks_do_not_depend_on_the_last_bits(levels: list[int], seed: int) -> None:
    exact = np.array([levels], dtype=np.float64) / 4
    noise = np.random.default_rng(seed).uniform(-BIT, BIT, exact.shape)
    assert ranked(exact + noise).tolist() == ranked(exact).tolist()
    assert ranked(exact).tolist() == np.argsort(-exact, axis=1, kind="stable").tolist()


@given(st.lists(st.sampled_from([0.0, 1.0, 1.0 + BIT, 1.0 - 2 * BIT, 2.0, np.inf]), max_size=9))
def test_a_row_is_ranked_alone_as_among_others(row: list[float]) -> None:
    alone, among = ranked(np.array([row])), ranked(np.array([row, row[::-1]]))
    assert alone.tolist() == among[:1].tolist()
    assert ranked(np.array([row]), 3).tolist() == among[:1, :3].tolist()


def grid_query(seed: int, noise: float = 0.0, *, ways_noise: float = 0.0) -> SearchQuery:
    """Containers on the points of a small grid, chances of a few levels: most orders have others of equal cost."""
    rng, small = np.random.default_rng(seed), np.random.default_rng((seed, 1))
    n = int(rng.integers(4, 13))
    at = rng.integers(0, 4, (n + 1, 2)).astype(np.float64)
    metres = np.abs(at[:, None] - at[None]).sum(axis=2)
    chances = rng.choice([0.1, 0.2, 0.4], (1, n))
    wobble = small.uniform(-1, 1, metres.shape)
    metres = metres * (1 + ways_noise * (wobble + wobble.T))
    names = tuple(ContainerId(f"c{i:02}") for i in range(n))
    return SearchQuery(
        item_type=MUG,
        origin=START,
        target=LocationId(names[-1]),
        belief=Belief(
            item_types=(MUG,),
            containers=names,
            probability=np.clip(chances + noise * small.uniform(-1, 1, chances.shape), 0, 1),
            estimator="test",
        ),
        travel=TravelCosts(locations=(START, *(LocationId(c) for c in names)), metres=metres),
        costs=SIMULATION_COSTS,
    )


@pytest.mark.parametrize("name", POLICIES)
def test_where_a_policy_looks_first_does_not_depend_on_the_last_bits(name: str) -> None:
    for seed in range(40):
        exact = grid_query(seed)
        first = first_stop(policy(name), exact)
        assert first == policy(name).order(exact)[0].container
        for noisy in (grid_query(seed, BIT), grid_query(seed, ways_noise=BIT)):
            assert first_stop(policy(name), noisy) == first, f"seed {seed}"


def test_nearest_containers_are_kept_by_their_order_where_all_lie_on_the_way() -> None:
    """Every container of a straight corridor has the same sum of distances, but for rounding."""
    from_m = np.array([0.1, 0.2, 0.3, 0.7])
    to_m = np.array([0.9, 0.8, 0.7, 0.3])
    p = np.array([[0.0, 0.0, 0.5, 0.6]])
    for bits in (0.0, BIT, -BIT):
        to_m_now = to_m + np.array([bits, 0, -bits, -2 * bits])
        assert choose(p, from_m, to_m_now, limit=3, ranking="probable").tolist() == [[0, 1, 3]]


@pytest.mark.parametrize("model", BELIEF_MODELS)
def test_both_programs_take_the_same_order(model: str) -> None:
    for seed in range(30):
        rng = np.random.default_rng(seed)
        k = int(rng.integers(2, 8))
        at = rng.integers(0, 3, (k + 1, 2)).astype(np.float64)
        metres = np.abs(at[:, None] - at[None]).sum(axis=2)
        p = rng.choice([0.1, 0.3], (1, k))
        missing = still_missing_by_subset(p, np.arange(k)[None], model)[0]  # type: ignore[arg-type]
        arrays = missing, metres[1:, 1:].copy(), metres[0, 1:].copy(), metres[1:, 0] + 5.0
        order = reference.best_order(*arrays, 0.0)
        assert compiled.best_order(*arrays, 0.0) == order, f"seed {seed}"
        noise = rng.uniform(-BIT, BIT, (1, k))
        noisy = still_missing_by_subset(p + noise, np.arange(k)[None], model)[0]  # type: ignore[arg-type]
        assert compiled.best_order(noisy, *arrays[1:], 0.0) == order, f"seed {seed}"
        assert reference.best_order(noisy, *arrays[1:], 0.0) == order, f"seed {seed}"


def test_both_programs_go_on_in_the_same_order() -> None:
    for seed in range(30):
        rng = np.random.default_rng(seed)
        n = 9
        at = rng.integers(0, 3, (n, 2)).astype(np.float64)
        between = np.abs(at[:, None] - at[None]).sum(axis=2)
        p = rng.choice([0.1, 0.2, 0.3], (1, n)) * rng.choice([1.0, 1e-9])
        searched = np.array([[0, 4]])
        from_m = between[searched].mean(axis=1)
        order = corrected.non_candidate_order(p, searched, from_m, between).tolist()
        assert non_candidate_order(p, searched, from_m, between).tolist() == order
        noisy = p * (1 + rng.uniform(-BIT, BIT, p.shape))
        assert non_candidate_order(noisy, searched, from_m, between).tolist() == order
        assert corrected.non_candidate_order(noisy, searched, from_m, between).tolist() == order
