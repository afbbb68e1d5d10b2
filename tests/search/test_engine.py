"""Eq. 1: compared with all orders and with cases solved by hand, and the properties that a find cost has."""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_travel

from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.search import compiled, engine, reference
from workbench.search.candidates import MAX_LIMIT, TooManyCandidates
from workbench.search.costs import ActionCosts
from workbench.search.engine import expected_find_costs, expected_search
from workbench.search.find_costs import BeliefModel
from workbench.search.places import LocationOutOfReach
from workbench.search.policy import SearchQuery
from workbench.search.remaining import BELIEF_MODELS, still_missing_by_subset
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG = ItemType("Mug")
COSTS = ActionCosts(search=1.0, manipulation=5.0)
FREE_LOOKS = ActionCosts(search=0.0, manipulation=5.0)


def world(positions: list[tuple[float, float]]) -> TravelCosts:
    """Start at the first position, containers c0, c1, ... at the others, straight lines between them."""
    at = np.array(positions)
    metres = np.linalg.norm(at[:, None] - at[None], axis=2)
    names = (START, *(LocationId(f"c{i}") for i in range(len(positions) - 1)))
    return TravelCosts(locations=names, metres=metres)


def belief(*rows: list[float]) -> Belief:
    containers = tuple(ContainerId(f"c{i}") for i in range(len(rows[0])))
    types = (MUG, *(ItemType(f"T{i}") for i in range(1, len(rows))))
    return Belief(item_types=types, containers=containers, probability=np.array(rows), estimator="test")


def missing_after(p: list[float], searched: tuple[int, ...], model: BeliefModel) -> float:
    """R(S), from its definition; a set has one, however many orders lead to it."""
    return _missing_after(tuple(p), tuple(sorted(searched)), model)


@lru_cache(maxsize=4096)
def _missing_after(p: tuple[float, ...], searched: tuple[int, ...], model: BeliefModel) -> float:
    others = [p[i] for i in range(len(p)) if i not in searched]
    if model == "exclusive":
        return sum(others) / sum(p)
    if model == "marginal":
        z = chance_of_any(p)
        if z == 0.0:
            return _missing_after(p, searched, "exclusive")
        return _missing_after(tuple(x * z for x in p), searched, "exists")
    nowhere = float(np.prod([1 - x for x in p]))
    inside = float(np.prod([1 - p[i] for i in searched]))
    return inside if model == "independent" else (inside - nowhere) / (1 - nowhere)


@lru_cache(maxsize=4096)
def chance_of_any(p: tuple[float, ...]) -> float:
    """The positive z of z = 1 - product of (1 - z p), by halving; 0 where there is none."""
    if sum(p) <= 1 + 1e-12:
        return 0.0
    low, high = 1e-15, 1.0
    for _ in range(200):
        middle = (low + high) / 2
        if -np.expm1(np.log1p(-np.array(p) * middle).sum()) > middle:
            low = middle
        else:
            high = middle
    return low


def cost_of(
    order: tuple[int, ...], p: list[float], travel: TravelCosts, model: BeliefModel, costs: ActionCosts
) -> float:
    """The expected cost of an order from start to start, written out."""
    total, at = 0.0, 0
    for stop, a in enumerate(order):
        before, after = (missing_after(p, order[:n], model) for n in (stop, stop + 1))
        total += before * (travel.metres[at, a + 1] + costs.search)
        total += (before - after) * (costs.manipulation + travel.metres[a + 1, 0])
        at = a + 1
    return total


coordinates = st.floats(-10, 10).map(lambda x: round(x, 3))
chances = st.floats(0.001, 0.999).map(lambda x: round(x, 3))


@st.composite
def small_worlds(draw: st.DrawFn) -> tuple[list[float], TravelCosts]:
    n = draw(st.integers(1, 6))
    positions = [(draw(coordinates), draw(coordinates)) for _ in range(n + 1)]
    return [draw(chances) for _ in range(n)], world(positions)


@settings(max_examples=60, deadline=None)
@given(small_worlds(), st.sampled_from(BELIEF_MODELS), st.floats(0, 3))
def test_no_order_costs_less_and_one_costs_as_much(
    drawn: tuple[list[float], TravelCosts], model: BeliefModel, search: float
) -> None:
    p, travel = drawn
    costs = ActionCosts(search=search, manipulation=5.0)
    least = min(cost_of(order, p, travel, model, costs) for order in permutations(range(len(p))))
    table = expected_find_costs(
        belief(p), travel, origins=(START,), targets=(START,), costs=costs, belief_model=model
    )
    assert table.of(MUG, START, START) == pytest.approx(least, rel=1e-9, abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(small_worlds(), st.sampled_from(BELIEF_MODELS))
def test_the_order_that_is_shown_is_the_one_that_the_table_prices(
    drawn: tuple[list[float], TravelCosts], model: BeliefModel
) -> None:
    p, travel = drawn
    query = SearchQuery(item_type=MUG, origin=START, target=START, belief=belief(p), travel=travel, costs=COSTS)
    found = expected_search(query, belief_model=model)
    table = expected_find_costs(
        belief(p), travel, origins=(START,), targets=(START,), costs=COSTS, belief_model=model
    )
    order = tuple(int(s.container[1:]) for s in found.stops)
    assert found.cost == pytest.approx(table.of(MUG, START, START), rel=1e-9, abs=1e-9)
    assert sum(found.partial_costs) == pytest.approx(cost_of(order, p, travel, model, COSTS), rel=1e-9)
    assert [s.reached for s in found.stops] == pytest.approx(
        [missing_after(p, order[:n], model) for n in range(len(p))], abs=1e-9
    )


def random_arrays(rng: np.random.Generator, k: int, targets: int) -> tuple[np.ndarray, ...]:
    p = rng.random((2, k)) * 0.6
    missing = np.stack([[np.prod([1 - row[j] for j in range(k) if s >> j & 1]) for s in range(1 << k)] for row in p])
    shapes = ((2, k, k), (2, 7, k), (2, k, targets))
    return (missing, *(rng.random(shape) * 10 for shape in shapes))


@pytest.mark.parametrize(("k", "targets"), [(1, 1), (2, 3), (5, 64), (6, 65), (8, 130), (11, 2)])
def test_the_compiled_program_gives_what_the_readable_one_gives(k: int, targets: int) -> None:
    missing, between, from_m, found = random_arrays(np.random.default_rng(k), k, targets)
    fast = compiled.cost_table(missing, between, from_m, found, 1.0)
    slow = reference.cost_table(missing, between, from_m, found, 1.0)
    assert np.abs(fast - slow).max() < 1e-9
    one = (missing[0], between[0], from_m[0, 0], found[0, :, 0].copy(), 1.0)
    assert compiled.best_order(*one) == reference.best_order(*one)


def test_without_numba_the_readable_program_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.delattr("workbench.search.compiled", raising=False)
    monkeypatch.setitem(sys.modules, "workbench.search.compiled", None)
    assert engine.program.__wrapped__() is reference


THREE_ON_A_LINE = world([(0, 0), (1, 0), (3, 0), (6, 0)])


def test_three_containers_on_a_line_worked_out_in_the_docstring() -> None:
    query = SearchQuery(
        item_type=MUG,
        origin=START,
        target=START,
        belief=belief([0.2, 0.5, 0.8]),
        travel=THREE_ON_A_LINE,
        costs=FREE_LOOKS,
    )
    found = expected_search(query)
    assert [s.container for s in found.stops] == ["c0", "c1", "c2"]
    assert found.cost == pytest.approx(11.72)
    assert found.partial_costs == pytest.approx((2.2, 4.8, 4.72))
    assert [s.probability for s in found.stops] == pytest.approx([0.2, 0.5, 0.8])
    assert [s.leg_m for s in found.stops] == [1, 2, 3]
    assert found.missing == pytest.approx(0.08)


def test_the_toy_house_worked_out_by_hand() -> None:
    """A mug in the counter (p = 1) 2 m away: 2 + 5 + 2. With p = 0 everywhere else nothing else is worth a step."""
    sure = Belief(
        item_types=(MUG,),
        containers=(FRIDGE, COUNTER, TABLE, BED, DESK),
        probability=np.array([[0.0, 1.0, 0.0, 0.0, 0.0]]),
        estimator="test",
    )
    for model in BELIEF_MODELS:
        table = expected_find_costs(
            sure, toy_travel(), origins=(START,), targets=(START,), costs=FREE_LOOKS, belief_model=model
        )
        assert table.of(MUG, START, START) == pytest.approx(9.0)


@settings(max_examples=25, deadline=None)
@given(small_worlds(), st.sampled_from(BELIEF_MODELS))
def test_walking_first_and_searching_then_never_costs_less(
    drawn: tuple[list[float], TravelCosts], model: BeliefModel
) -> None:
    p, travel = drawn
    at = travel.locations
    metres = expected_find_costs(
        belief(p), travel, origins=at, targets=at, costs=COSTS, belief_model=model, limit=3
    ).metres[0]
    step = travel.metres
    assert (metres[:, None, :] <= step[:, :, None] + metres[None] + 1e-9).all()
    assert (metres[:, :, None] <= metres[:, None, :] + step.T[None] + 1e-9).all()


@settings(max_examples=25, deadline=None)
@given(small_worlds(), st.sampled_from(BELIEF_MODELS))
def test_the_table_does_not_depend_on_the_order_of_containers(
    drawn: tuple[list[float], TravelCosts], model: BeliefModel
) -> None:
    p, travel = drawn
    table = expected_find_costs(
        belief(p), travel, origins=(START,), targets=(START,), costs=COSTS, belief_model=model
    )
    turned = Belief(
        item_types=(MUG,),
        containers=tuple(reversed(belief(p).containers)),
        probability=np.array([p[::-1]]),
        estimator="test",
    )
    again = expected_find_costs(turned, travel, origins=(START,), targets=(START,), costs=COSTS, belief_model=model)
    assert again.metres == pytest.approx(table.metres, abs=1e-9)


def test_each_row_of_a_table_is_what_it_would_be_alone() -> None:
    rng = np.random.default_rng(5)
    travel = world([tuple(x) for x in rng.random((12, 2)) * 10])
    rows = (rng.random((4, 11)) * 0.4).tolist()
    at = travel.locations
    whole = expected_find_costs(belief(*rows), travel, origins=at, targets=at, costs=COSTS, belief_model="exists")
    for i, row in enumerate(rows):
        alone = expected_find_costs(belief(row), travel, origins=at, targets=at, costs=COSTS, belief_model="exists")
        assert whole.metres[i] == pytest.approx(alone.metres[0], abs=1e-9)


def test_many_item_types_are_taken_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    travel = world([tuple(x) for x in rng.random((7, 2)) * 10])
    rows = belief(*(rng.random((5, 6)) * 0.4).tolist())
    ends = {"origins": travel.locations, "targets": travel.locations, "costs": COSTS, "belief_model": "marginal"}
    whole = expected_find_costs(rows, travel, **ends)  # type: ignore[arg-type]
    monkeypatch.setattr(engine, "MAX_SUBSETS", 1 << 7)
    in_parts = expected_find_costs(rows, travel, **ends)  # type: ignore[arg-type]
    assert in_parts.metres == pytest.approx(whole.metres, abs=1e-12)


def test_more_candidates_see_more_of_the_cost_under_a_belief_that_knows_of_an_instance() -> None:
    rng = np.random.default_rng(6)
    travel = world([tuple(x) for x in rng.random((12, 2)) * 10])
    rows = belief((rng.random(11) * 0.2).tolist())
    reached = [
        expected_search(
            SearchQuery(item_type=MUG, origin=START, target=START, belief=rows, travel=travel, costs=COSTS),
            belief_model="exists",
            limit=limit,
        ).missing
        for limit in (4, 8, 11)
    ]
    assert reached[0] > reached[1] > reached[2] == pytest.approx(0.0, abs=1e-12)


def prices(p: list[float], model: BeliefModel, **changes: object) -> float:
    travel = world([(0, 0), *((float(i + 1), 0.0) for i in range(len(p)))])
    settings_ = {"origins": (START,), "targets": (START,), "costs": COSTS, "belief_model": model, **changes}
    return expected_find_costs(belief(p), travel, **settings_).of(MUG, START, START)  # type: ignore[arg-type]


@pytest.mark.parametrize("model", BELIEF_MODELS)
def test_nothing_left_to_search_costs_nothing_as_eq_1_says(model: BeliefModel) -> None:
    empty = Belief(item_types=(MUG,), containers=(), probability=np.zeros((1, 0)), estimator="test")
    table = expected_find_costs(
        empty, THREE_ON_A_LINE, origins=(START,), targets=(START,), costs=COSTS, belief_model=model
    )
    assert table.of(MUG, START, START) == 0.0
    query = SearchQuery(item_type=MUG, origin=START, target=START, belief=empty, travel=THREE_ON_A_LINE, costs=COSTS)
    assert expected_search(query, belief_model=model).stops == ()


def test_one_container() -> None:
    assert prices([0.25], "independent") == pytest.approx(1 + 1 + 0.25 * 6)
    assert prices([0.25], "exists") == pytest.approx(1 + 1 + 6)
    assert prices([0.25], "exclusive") == pytest.approx(1 + 1 + 6)
    assert prices([0.25], "marginal") == pytest.approx(1 + 1 + 6)


def test_probabilities_of_nought_everywhere() -> None:
    """Independent walks through all of them for nothing; the others know it is there and equally likely anywhere."""
    assert prices([0.0, 0.0], "independent") == pytest.approx(2 + 2)
    expected = (1 + 1 + 0.5 * 6) + 0.5 * (1 + 1 + 7)
    assert prices([0.0, 0.0], "exists") == pytest.approx(expected)
    assert prices([0.0, 0.0], "exclusive") == pytest.approx(expected)
    assert prices([0.0, 0.0], "marginal") == pytest.approx(expected)


def test_probabilities_of_one_everywhere() -> None:
    assert prices([1.0, 1.0], "independent") == pytest.approx(8.0)
    assert prices([1.0, 1.0], "exists") == pytest.approx(8.0)
    assert prices([1.0, 1.0], "marginal") == pytest.approx(8.0)
    assert prices([1.0, 1.0], "exclusive") == pytest.approx((1 + 1 + 0.5 * 6) + 0.5 * (1 + 1 + 7))


def test_probabilities_that_are_almost_nought_keep_their_proportions() -> None:
    assert prices([1e-300, 3e-300], "exists") == pytest.approx(prices([0.1, 0.3], "exclusive"), rel=1e-9)


def test_marginal_keeps_the_chances_that_it_is_given() -> None:
    """The chance to find an item in the container looked into first is what the belief says of that container."""
    for p in ([0.9, 0.6, 0.3], [0.5, 0.6], [1.0, 0.5, 0.2]):
        table = still_missing_by_subset(np.array([p]), np.arange(len(p))[None], "marginal")[0]
        assert [1 - table[1 << j] for j in range(len(p))] == pytest.approx(p, abs=1e-9)
    spread = still_missing_by_subset(np.array([[0.3, 0.1]]), np.arange(2)[None], "marginal")[0]
    assert 1 - spread[1] == pytest.approx(0.75, abs=1e-6)


def test_sums_above_one_are_no_mistake() -> None:
    assert prices([0.9, 0.9, 0.9], "exclusive") == pytest.approx(prices([0.1, 0.1, 0.1], "exclusive"))


def test_containers_that_cannot_be_reached_are_left_out() -> None:
    both = Belief(
        item_types=(MUG,),
        containers=(ContainerId("c0"), ContainerId("walled-in")),
        probability=np.array([[0.5, 0.9]]),
        estimator="test",
    )
    table = expected_find_costs(
        both, THREE_ON_A_LINE, origins=(START,), targets=(START,), costs=COSTS, belief_model="exists"
    )
    assert table.of(MUG, START, START) == pytest.approx(1 + 1 + 6)


def test_an_origin_that_is_itself_unsearched_is_looked_into_on_the_spot() -> None:
    table = expected_find_costs(
        belief([1.0, 0.1, 0.1]),
        THREE_ON_A_LINE,
        origins=(LocationId("c0"),),
        targets=(LocationId("c0"),),
        costs=COSTS,
    )
    assert table.metres[0, 0, 0] == pytest.approx(1 + 5)


def test_an_origin_out_of_reach_is_named() -> None:
    with pytest.raises(LocationOutOfReach, match="attic"):
        prices([0.5], "independent", origins=(LocationId("attic"),))


@pytest.mark.parametrize("limit", [0, -1])
def test_a_limit_below_one_is_refused(limit: int) -> None:
    with pytest.raises(BadValue, match="candidate limit"):
        prices([0.5], "independent", limit=limit)


@pytest.mark.parametrize("limit", [30, 1000])
def test_a_limit_beyond_reach_is_refused_with_the_subsets_it_would_take(limit: int) -> None:
    with pytest.raises(TooManyCandidates, match=rf"2\^{limit} subsets"):
        prices([0.5], "independent", limit=limit)
    assert limit > MAX_LIMIT


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_costs_that_are_no_costs_are_refused(value: float) -> None:
    with pytest.raises(BadValue, match="cost of search"):
        ActionCosts(search=value)


def test_an_unknown_belief_model_is_refused() -> None:
    with pytest.raises(BadValue, match="belief model"):
        prices([0.5], "certain")  # type: ignore[arg-type]


def test_no_item_types_give_an_empty_table() -> None:
    none = Belief(item_types=(), containers=(ContainerId("c0"),), probability=np.zeros((0, 1)), estimator="test")
    table = expected_find_costs(none, THREE_ON_A_LINE, origins=(START,), targets=(START,), costs=COSTS)
    assert table.metres.shape == (0, 1, 1)


def test_a_belief_about_some_of_its_types_has_their_rows_and_nothing_of_others() -> None:
    mug, book, egg = ItemType("Mug"), ItemType("Book"), ItemType("Egg")
    belief = Belief(
        item_types=(mug, book), containers=(BED,), probability=np.array([[0.2], [0.7]]), estimator="by hand"
    )
    some = belief.only((egg, book))
    assert some.probability.tolist() == [[0.0], [0.7]]
    assert (some.item_types, some.containers, some.estimator) == ((egg, book), (BED,), "by hand")
    assert belief.only((egg, book)) is some
    assert belief.only((mug, book)) is belief
