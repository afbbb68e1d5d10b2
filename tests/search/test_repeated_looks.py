"""Eq. 1 over look counts: against all sequences of looks and all worlds, and the cases that are known."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.search.costs import ActionCosts
from workbench.search.engine import expected_find_costs
from workbench.search.find_costs import BeliefModel
from workbench.search.places import search_space
from workbench.search.policies.registry import policy
from workbench.search.policy import SearchQuery
from workbench.search.remaining import BELIEF_MODELS, still_missing_by_subset, unconditioned
from workbench.search.repeated_looks import compiled, reference, simd, table
from workbench.search.repeated_looks.missing import still_missing_along_looks, still_missing_by_counts
from workbench.search.repeated_looks.table import LookModel, best_looks, robust_find_costs
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG, BOOK = ItemType("Mug"), ItemType("Book")
COSTS = ActionCosts(search=1.0, manipulation=5.0)
FREE_LOOKS = ActionCosts(search=0.0, manipulation=5.0)


def world(positions: np.ndarray) -> TravelCosts:
    """Start at the first position, containers c0, c1, ... at the others, straight lines between them."""
    names = (START, *(LocationId(f"c{i}") for i in range(len(positions) - 1)))
    return TravelCosts(locations=names, metres=np.linalg.norm(positions[:, None] - positions[None], axis=2))


def belief(rows: np.ndarray, detect: tuple[float, ...]) -> Belief:
    return Belief(
        item_types=(MUG, BOOK)[: len(rows)],
        containers=tuple(ContainerId(f"c{i}") for i in range(rows.shape[1])),
        probability=rows,
        estimator="test",
        p_detect=detect,
    )


def missing_in_worlds(p: np.ndarray, q: float, sequence: tuple[int, ...], model: BeliefModel) -> float:
    """The chance that the looks of a sequence show nothing, over all worlds that the belief model allows."""
    return _missing_in_worlds(tuple(p.tolist()), q, tuple(sorted(sequence)), model)


@lru_cache(maxsize=4096)
def _missing_in_worlds(of: tuple[float, ...], q: float, sequence: tuple[int, ...], model: BeliefModel) -> float:
    p = np.array(of)
    unseen = [q ** sequence.count(a) for a in range(len(p))]
    if model == "exclusive":
        return float(np.dot(p, unseen) / p.sum())
    p = unconditioned(p[None], model)[0]
    missed = total = 0.0
    for holds in product((False, True), repeat=len(p)):
        if model == "independent" or any(holds):
            chance = float(np.prod(np.where(holds, p, 1 - p)))
            total += chance
            missed += chance * float(np.prod(np.where(holds, unseen, 1.0)))
    return missed / total


def least_over_sequences(
    p: np.ndarray, q: float, travel: TravelCosts, model: BeliefModel, costs: ActionCosts, looks: int
) -> float:
    """The least expected cost from start to start over all sequences that look into each container so often."""
    d, costs_of_all = travel.metres, []
    for sequence in set(permutations(sorted(list(range(len(p))) * looks))):
        total, at = 0.0, 0
        for stop, a in enumerate(sequence):
            before, after = (missing_in_worlds(p, q, sequence[:n], model) for n in (stop, stop + 1))
            total += before * (d[at, a + 1] + costs.search) + (before - after) * (costs.manipulation + d[a + 1, 0])
            at = a + 1
        costs_of_all.append(total)
    return min(costs_of_all)


def drawn(seed: int, n: int) -> tuple[np.ndarray, TravelCosts]:
    rng = np.random.default_rng(seed)
    return rng.beta(0.8, 2.0, n) * 0.98 + 0.01, world(rng.random((n + 1, 2)) * 6)


@pytest.mark.parametrize("model", BELIEF_MODELS)
@pytest.mark.parametrize("search", [0.0, 0.2, 1.0])
@pytest.mark.parametrize(("n", "looks"), [(1, 3), (2, 3), (3, 2)])
def test_no_sequence_of_looks_costs_less(n: int, looks: int, search: float, model: BeliefModel) -> None:
    p, travel = drawn(n + looks, n)
    costs = ActionCosts(search=search, manipulation=5.0)
    least = least_over_sequences(p, 0.3, travel, model, costs, looks)
    ends = {"origins": (START,), "targets": (START,), "costs": costs}
    settings_ = LookModel(belief_model=model, looks=looks)
    made = robust_find_costs(belief(p[None], (0.7,)), travel, model=settings_, **ends)  # type: ignore[arg-type]
    assert made.of(MUG, START, START) == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("model", BELIEF_MODELS)
@pytest.mark.parametrize("seed", range(3))
def test_no_sequence_of_looks_into_four_containers_costs_less(seed: int, model: BeliefModel) -> None:
    p, travel = drawn(seed, 4)
    for costs in (FREE_LOOKS, COSTS):
        least = least_over_sequences(p, 0.3, travel, model, costs, 2)
        made = robust_find_costs(
            belief(p[None], (0.7,)),
            travel,
            origins=(START,),
            targets=(START,),
            costs=costs,
            model=LookModel(belief_model=model),
        )
        assert made.of(MUG, START, START) == pytest.approx(least, rel=1e-9)


@pytest.mark.parametrize("model", BELIEF_MODELS)
@pytest.mark.parametrize("detect", [(), (1.0, 1.0), (1.0, 0.6)])
def test_what_a_look_detects_for_certain_costs_what_it_always_did(
    detect: tuple[float, ...], model: BeliefModel
) -> None:
    rng = np.random.default_rng(4)
    travel = world(rng.random((14, 2)) * 9)
    rows = belief(rng.beta(0.5, 3.0, (2, 13)), detect)
    ends = {"origins": travel.locations, "targets": travel.locations}
    for costs in (COSTS, FREE_LOOKS):
        once = expected_find_costs(rows, travel, costs=costs, belief_model=model, **ends)  # type: ignore[arg-type]
        made = robust_find_costs(rows, travel, costs=costs, model=LookModel(belief_model=model), **ends)  # type: ignore[arg-type]
        certain = [rows.detects(t) == 1.0 for t in rows.item_types]
        assert made.metres[certain].tobytes() == once.metres[certain].tobytes()
        assert (made.metres[~np.array(certain)] != once.metres[~np.array(certain)]).all()


def test_one_look_a_container_that_cannot_miss_is_the_program_that_looks_once() -> None:
    rng = np.random.default_rng(5)
    k = 6
    p, candidates = rng.random((2, 9)), np.tile(np.arange(k), (2, 1))
    for model in BELIEF_MODELS:
        counted = still_missing_by_counts(p, candidates, np.zeros_like(p), model, (0, 1))
        assert counted == pytest.approx(still_missing_by_subset(p, candidates, model), rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(BELIEF_MODELS), st.sampled_from([0.0, 0.05, 0.5, 0.99]))
def test_what_is_missing_is_what_the_worlds_say(seed: int, model: BeliefModel, q: float) -> None:
    rng = np.random.default_rng(seed)
    p = rng.choice([0.001, 0.2, 0.7, 0.999], 4) if seed % 2 else rng.random(4)
    miss, counts = np.full((1, 4), q), (0, 1, 2)
    by_state = still_missing_by_counts(p[None], np.array([[0, 1, 3]]), miss, model, counts)[0]
    assert by_state[0] == pytest.approx(1.0)
    for state, digits in enumerate(product(counts, repeat=3)):
        sequence = tuple(a for a, n in zip((3, 1, 0), digits, strict=True) for _ in range(n))
        said = missing_in_worlds(p, q, sequence, model)
        assert by_state[state] == pytest.approx(said, abs=1e-9)
        along = still_missing_along_looks(p, np.array(sequence, dtype=np.intp), miss[0], model)
        assert along[-1] == pytest.approx(said, abs=1e-9)


@pytest.mark.parametrize(
    ("k", "looks", "targets"), [(1, 3, 1), (3, 3, 9), (5, 2, 17), (7, 2, 8), (4, 2, 40), (3, 2, 90)]
)
def test_the_compiled_program_gives_what_the_readable_one_gives(k: int, looks: int, targets: int) -> None:
    rng = np.random.default_rng(k)
    p = rng.random((2, k)) * 0.6
    missing = still_missing_by_counts(
        p, np.tile(np.arange(k), (2, 1)), np.full_like(p, 0.3), "independent", tuple(range(looks + 1))
    )
    between, from_m, found = (rng.random(shape) * 10 for shape in ((2, k, k), (2, 7, k), (2, k, targets)))
    fast = compiled.cost_table(missing, between, from_m, found, 1.0, looks)
    slow = reference.cost_table(missing, between, from_m, found, 1.0, looks)
    assert np.abs(fast - slow).max() < 1e-9
    one = (missing[0], between[0], from_m[0, 0], found[0, :, 0].copy(), 1.0, looks)
    assert compiled.best_sequence(*one) == reference.best_sequence(*one)


@pytest.mark.parametrize("as_integers", [True, False])
def test_minima_are_the_same_however_the_processor_compares(
    as_integers: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from numba import njit

    monkeypatch.setattr(simd, "AS_INTEGERS", as_integers)
    compiled_anew = njit(simd.least.py_func, nogil=True)
    rng = np.random.default_rng(3)
    for _ in range(50):
        onward, metres = (
            np.power(10.0, rng.integers(-300, 3, size=(4, 24))),
            rng.random(6) * rng.integers(0, 2, size=6),
        )
        onward[rng.random(onward.shape) < 0.2] = 0.0
        left, r, best = np.array([5, 0, 3, 2], dtype=np.uint64), rng.random(), np.empty(24)
        compiled_anew(best, r, metres, left, 4, onward)
        assert (best == (r * metres[[5, 0, 3, 2], None] + onward).min(axis=0)).all()


def test_without_numba_the_readable_program_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.delattr("workbench.search.repeated_looks.compiled", raising=False)
    monkeypatch.setitem(sys.modules, "workbench.search.repeated_looks.compiled", None)
    assert table.program.__wrapped__() is reference


def test_many_item_types_are_taken_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    travel = world(rng.random((6, 2)) * 9)
    rows = belief(rng.random((2, 5)) * 0.4, (0.7, 0.9))
    ends = {"origins": travel.locations, "targets": travel.locations, "costs": COSTS}
    whole = robust_find_costs(rows, travel, **ends)  # type: ignore[arg-type]
    monkeypatch.setattr(table, "MAX_STATES", 1)
    assert robust_find_costs(rows, travel, **ends).metres == pytest.approx(whole.metres, abs=1e-12)  # type: ignore[arg-type]


def test_the_policy_prices_what_the_table_says_and_looks_again() -> None:
    p, travel = drawn(11, 6)
    for costs in (COSTS, FREE_LOOKS):
        query = SearchQuery(
            item_type=MUG, origin=START, target=START, belief=belief(p[None], (0.6,)), travel=travel, costs=costs
        )
        robust = policy("robust-lios")
        made = robust.search(query)  # type: ignore[attr-defined]
        price = robust_find_costs(query.belief, travel, origins=(START,), targets=(START,), costs=costs)
        assert made.cost == pytest.approx(price.of(MUG, START, START), rel=1e-9)
        looked = [s.container for s in made.stops]
        assert {looked.count(c) for c in looked} == {2}
        assert [s.container for s in robust.order(query)] == list(dict.fromkeys(looked))


def test_the_policy_is_conditioned_lios_where_looks_detect_for_certain() -> None:
    rng = np.random.default_rng(12)
    for n in (3, 12):
        query = SearchQuery(
            item_type=MUG,
            origin=START,
            target=START,
            belief=belief(rng.random((1, n)) * 0.5, ()),
            travel=world(rng.random((n + 1, 2)) * 9),
            costs=COSTS,
        )
        ours, theirs = policy("robust-lios"), policy("conditioned-lios")
        assert ours.search(query) == theirs.search(query)  # type: ignore[attr-defined]
        assert ours.first(query) == theirs.first(query)  # type: ignore[attr-defined]


@pytest.mark.parametrize("seed", range(4))
def test_without_travel_the_greatest_chance_to_detect_comes_next(seed: int) -> None:
    """Blackwell (in Matula 1964) and Chew (1967): each look where p q^n (1 - q) is greatest, all looks costing 1."""
    rng = np.random.default_rng(seed)
    n, detect, looks = 5, 0.6, 3
    p = rng.dirichlet(np.ones(n))
    travel = TravelCosts(locations=(START, *(LocationId(f"c{i}") for i in range(n))), metres=np.zeros((n + 1, n + 1)))
    here = search_space(belief(p[None], (detect,)), travel, origins=(START,), targets=(START,))
    costs = ActionCosts(search=1.0, manipulation=0.0)
    made = best_looks(here, 0, detect, costs=costs, model=LookModel(belief_model="exclusive", looks=looks))
    gain, known = p * detect, []
    while len(known) < n * looks:
        gain[[known.count(a) == looks for a in range(n)]] = -1.0
        known.append(int(np.argmax(gain)))
        gain[known[-1]] *= 1 - detect
    assert made.tolist() == known
    assert known != sorted(known, key=known.index), "some place is left and looked into again"


@pytest.mark.parametrize("looks", [0, 4])
def test_looks_out_of_range_are_refused(looks: int) -> None:
    with pytest.raises(BadValue, match="looks into a container"):
        LookModel(looks=looks)


def test_nothing_left_to_search_costs_nothing() -> None:
    empty = belief(np.zeros((1, 0)), (0.5,))
    travel = world(np.zeros((1, 2)))
    made = robust_find_costs(empty, travel, origins=(START,), targets=(START,), costs=COSTS)
    assert made.of(MUG, START, START) == 0.0
    query = SearchQuery(item_type=MUG, origin=START, target=START, belief=empty, travel=travel, costs=COSTS)
    assert policy("robust-lios").order(query) == ()
    assert replace(empty, p_detect=()).detects(MUG) == 1.0
