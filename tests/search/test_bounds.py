"""Optimistic and pessimistic find costs, and what the correction adds to Eq. 1."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_travel

from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.search import corrected
from workbench.search.bounds import PESSIMISTIC_PENALTY, optimistic_find_costs, pessimistic_find_costs
from workbench.search.corrected import corrected_find_costs, scale_of
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.search.engine import expected_find_costs
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.remaining import BELIEF_MODELS
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG, EGG = ItemType("Mug"), ItemType("Egg")
TOY = Belief(
    item_types=(MUG, EGG),
    containers=(FRIDGE, COUNTER, TABLE, BED, DESK),
    probability=np.array([[0.1, 0.6, 0.3, 0.1, 0.2], [0.9, 0.1, 0.1, 0.01, 0.01]]),
    estimator="test",
)
AT = toy_travel().locations


def test_the_optimist_finds_it_where_it_is_most_on_the_way() -> None:
    """Start to start: the table, 1 m away: 1 + 5 + 1. Bed to desk: in either, 2 m in all. Costs 1 a look more."""
    costs = optimistic_find_costs(TOY, toy_travel(), origins=AT, targets=AT, costs=SIMULATION_COSTS)
    assert costs.of(MUG, START, START) == 7.0
    assert costs.of(MUG, LocationId(BED), LocationId(DESK)) == 7.0
    assert (costs.metres[0] == costs.metres[1]).all()
    looked = optimistic_find_costs(TOY, toy_travel(), origins=AT, targets=AT, costs=ActionCosts(search=1.0))
    assert (looked.metres == costs.metres + 1).all()


def test_the_pessimist_adds_a_penalty() -> None:
    optimistic = optimistic_find_costs(TOY, toy_travel(), origins=AT, targets=AT, costs=SIMULATION_COSTS)
    pessimistic = pessimistic_find_costs(TOY, toy_travel(), origins=AT, targets=AT, costs=SIMULATION_COSTS)
    assert (pessimistic.metres == optimistic.metres + PESSIMISTIC_PENALTY).all()
    assert (pessimistic.kind, optimistic.kind) == ("pessimistic", "optimistic")


def test_nothing_left_to_search_costs_the_optimist_nothing() -> None:
    empty = Belief(item_types=(MUG,), containers=(), probability=np.zeros((1, 0)), estimator="test")
    costs = optimistic_find_costs(empty, toy_travel(), origins=AT, targets=AT, costs=SIMULATION_COSTS)
    assert not costs.metres.any()


def line_world(p: list[float]) -> tuple[Belief, TravelCosts]:
    """The start at 0 m, a container every metre from 1 m on."""
    n = len(p)
    at = np.arange(n + 1, dtype=float)
    names = tuple(ContainerId(f"c{i}") for i in range(n))
    belief = Belief(item_types=(MUG,), containers=names, probability=np.array([p]), estimator="test")
    travel = TravelCosts(locations=(START, *map(LocationId, names)), metres=np.abs(at[:, None] - at[None]))
    return belief, travel


def price(table: FindCosts) -> float:
    return float(table.metres[0, 0, 0])


@pytest.mark.parametrize("model", BELIEF_MODELS)
def test_the_correction_counts_the_containers_that_are_no_candidates(model: BeliefModel) -> None:
    """Candidates at 1 and 2 m, two more behind them: from start to start with one candidate after the other."""
    belief, travel = line_world([0.4, 0.3, 0.2, 0.1])
    ends = {"origins": (START,), "targets": (START,), "costs": SIMULATION_COSTS, "belief_model": model}
    whole = expected_find_costs(belief, travel, limit=4, **ends)  # type: ignore[arg-type]
    short = expected_find_costs(belief, travel, limit=2, **ends)  # type: ignore[arg-type]
    longer = corrected_find_costs(belief, travel, limit=2, scale=1.0, **ends)  # type: ignore[arg-type]
    assert price(short) < price(whole)
    assert price(longer) == pytest.approx(price(whole))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.01, 0.9), min_size=1, max_size=12), st.integers(1, 5), st.sampled_from(BELIEF_MODELS))
def test_the_correction_never_lowers_a_cost_and_changes_nothing_with_all_candidates(
    p: list[float], limit: int, model: BeliefModel
) -> None:
    belief, travel = line_world(p)
    ends = {
        "origins": travel.locations,
        "targets": travel.locations,
        "costs": SIMULATION_COSTS,
        "belief_model": model,
    }
    plain = expected_find_costs(belief, travel, limit=limit, **ends)  # type: ignore[arg-type]
    more = corrected_find_costs(belief, travel, limit=limit, scale=1.0, **ends)  # type: ignore[arg-type]
    assert (more.metres >= plain.metres - 1e-9).all()
    if len(p) <= limit:
        assert more.metres == pytest.approx(plain.metres)


def test_the_scale_is_the_estimators_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(corrected, "SCALES", {"test": 1.5})
    belief, travel = line_world([0.4, 0.3])
    ends = {"origins": (START,), "targets": (START,), "costs": SIMULATION_COSTS}
    own = corrected_find_costs(belief, travel, **ends)  # type: ignore[arg-type]
    plain = corrected_find_costs(belief, travel, scale=1.0, **ends)  # type: ignore[arg-type]
    assert price(own) == pytest.approx(1.5 * price(plain))
    assert scale_of("test@1a2b3c4d") == 1.5
    assert scale_of("a third party's") == 1.0


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_a_scale_that_is_none_is_refused(scale: float) -> None:
    belief, travel = line_world([0.4])
    with pytest.raises(BadValue, match="scale"):
        corrected_find_costs(belief, travel, origins=(START,), targets=(START,), costs=SIMULATION_COSTS, scale=scale)


def test_the_order_of_finds_is_kept_by_a_scale() -> None:
    ends = {"origins": AT, "targets": AT, "costs": SIMULATION_COSTS}
    plain = corrected_find_costs(TOY, toy_travel(), scale=1.0, **ends)  # type: ignore[arg-type]
    scaled = corrected_find_costs(TOY, toy_travel(), scale=1.2, **ends)  # type: ignore[arg-type]
    assert (np.argsort(plain.metres, axis=None) == np.argsort(scaled.metres, axis=None)).all()
