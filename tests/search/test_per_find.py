"""Find costs with candidates of each find's own: every entry is the expected cost of the search that is walked."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.beliefs.belief import Belief
from workbench.search import compiled, engine, per_find, reference
from workbench.search.candidates import choose, choose_per_find
from workbench.search.costs import ActionCosts
from workbench.search.engine import expected_find_costs, expected_search
from workbench.search.per_find import per_find_costs
from workbench.search.policy import SearchQuery
from workbench.search.remaining import BELIEF_MODELS
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

COSTS = ActionCosts(search=1.0, manipulation=5.0)
TYPES = (ItemType("Mug"), ItemType("Book"))


def world(containers: int, seed: int) -> tuple[Belief, TravelCosts]:
    rng = np.random.default_rng(seed)
    at = rng.random((containers + 1, 2)) * 12
    names = tuple(ContainerId(f"c{i:02}") for i in range(containers))
    belief = Belief(
        item_types=TYPES, containers=names, probability=rng.beta(0.5, 3.0, (2, containers)), estimator="test"
    )
    locations = (START, *(LocationId(c) for c in names))
    return belief, TravelCosts(locations=locations, metres=np.linalg.norm(at[:, None] - at[None], axis=2))


@pytest.mark.parametrize("model", BELIEF_MODELS)
@pytest.mark.parametrize(("containers", "limit"), [(5, 8), (8, 8), (14, 8), (14, 3), (9, 1)])
def test_every_entry_is_the_cost_of_the_search_that_carries_it_out(model: str, containers: int, limit: int) -> None:
    belief, travel = world(containers, seed=containers + limit)
    origins, targets = travel.locations[:4], travel.locations[2:7]
    how = {"belief_model": model, "limit": limit}
    table = per_find_costs(belief, travel, origins=origins, targets=targets, costs=COSTS, **how)  # type: ignore[arg-type]
    for item_type in TYPES:
        for origin in origins:
            for target in targets:
                query = SearchQuery(
                    item_type=item_type, origin=origin, target=target, belief=belief, travel=travel, costs=COSTS
                )
                walked = expected_search(query, **how).cost  # type: ignore[arg-type]
                assert table.of(item_type, origin, target) == pytest.approx(walked, rel=1e-12, abs=1e-12)


def test_with_no_more_containers_than_candidates_it_is_the_shared_table_and_else_not() -> None:
    for containers, same in ((8, True), (14, False)):
        belief, travel = world(containers, seed=2)
        at = travel.locations
        own = per_find_costs(belief, travel, origins=at, targets=at, costs=COSTS).metres
        shared = expected_find_costs(belief, travel, origins=at, targets=at, costs=COSTS).metres
        assert np.allclose(own, shared, rtol=1e-9) == same


@pytest.mark.parametrize("ranking", ["probable", "worth"])
def test_candidates_of_all_pairs_are_those_of_each(ranking: str) -> None:
    belief, travel = world(13, seed=5)
    from_m, to_m = travel.metres[:5, 1:], travel.metres[1:, 3:9]
    chosen = choose_per_find(belief.probability, from_m, to_m, limit=6, ranking=ranking)  # type: ignore[arg-type]
    for o in range(5):
        for t in range(6):
            one = choose(belief.probability, from_m[o], to_m[:, t], limit=6, ranking=ranking)  # type: ignore[arg-type]
            assert chosen[:, o, t].tolist() == one.tolist()


def test_both_programs_give_the_same_costs(monkeypatch: pytest.MonkeyPatch) -> None:
    belief, travel = world(12, seed=7)
    at = travel.locations[:5]
    fast = per_find_costs(belief, travel, origins=at, targets=at, costs=COSTS, limit=5).metres
    assert engine.program() is compiled
    monkeypatch.setattr(per_find, "program", lambda: reference)
    slow = per_find_costs(belief, travel, origins=at, targets=at, costs=COSTS, limit=5).metres
    assert np.abs(fast - slow).max() < 1e-9


def test_sets_that_do_not_fit_at_once_are_worked_off_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    belief, travel = world(12, seed=8)
    at = travel.locations[:5]
    whole = per_find_costs(belief, travel, origins=at, targets=at, costs=COSTS, limit=5).metres
    monkeypatch.setattr(per_find, "MAX_SUBSETS", 3 << 5)
    assert (per_find_costs(belief, travel, origins=at, targets=at, costs=COSTS, limit=5).metres == whole).all()
