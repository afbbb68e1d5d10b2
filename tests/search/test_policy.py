"""The contract of every search policy, and what each one does on the toy house."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import EntryPoint
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_house, toy_travel

from workbench import plugins
from workbench.beliefs.belief import Belief
from workbench.errors import BadValue, UnknownName
from workbench.plugins import NameOrigin, PluginNotLoaded
from workbench.search.candidates import TooManyCandidates
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.search.engine import expected_search
from workbench.search.find_costs import SearchStop
from workbench.search.orders import order_cost
from workbench.search.places import search_space
from workbench.search.policies.full_tour import FullTour
from workbench.search.policies.least_expected_cost import LeastExpectedCost
from workbench.search.policies.oracle import oracle_policy
from workbench.search.policies.registry import POLICIES, policy, policy_names
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG = ItemType("Mug")
ALL = (FRIDGE, COUNTER, TABLE, BED, DESK)


def toy_query(chances: dict[ContainerId, float], *, item: ItemType = MUG) -> SearchQuery:
    return SearchQuery(
        item_type=item,
        origin=START,
        target=START,
        belief=Belief(
            item_types=(item,),
            containers=ALL,
            probability=np.array([[chances.get(c, 0.01) for c in ALL]]),
            estimator="test",
        ),
        travel=toy_travel(),
        costs=SIMULATION_COSTS,
    )


def random_query(n: int, *, seed: int, search: float = 0.0) -> SearchQuery:
    rng = np.random.default_rng(seed)
    at = rng.random((n + 1, 2)) * 12
    names = tuple(ContainerId(f"c{i}") for i in range(n))
    return SearchQuery(
        item_type=MUG,
        origin=START,
        target=START,
        belief=Belief(
            item_types=(MUG,), containers=names, probability=rng.beta(0.5, 3.0, size=(1, n)), estimator="test"
        ),
        travel=TravelCosts(
            locations=(START, *(LocationId(x) for x in names)),
            metres=np.linalg.norm(at[:, None] - at[None], axis=2),
        ),
        costs=ActionCosts(search=search),
    )


def every_policy() -> list[SearchPolicy]:
    return [*(make() for make in POLICIES.values()), oracle_policy(toy_house())]


@pytest.mark.parametrize("searcher", every_policy(), ids=lambda p: p.name)
class TestContract:
    def test_it_visits_containers_of_the_belief_once_each(self, searcher: SearchPolicy) -> None:
        order = [s.container for s in searcher.order(toy_query({DESK: 0.4, TABLE: 0.2}))]
        assert order
        assert set(order) <= set(ALL)
        assert len(set(order)) == len(order)

    def test_its_stops_say_what_the_way_and_the_chances_are(self, searcher: SearchPolicy) -> None:
        query = toy_query({DESK: 0.4, TABLE: 0.2})
        at, reached = query.origin, 1.0
        for stop in searcher.order(query):
            assert stop.leg_m == query.travel.between(at, LocationId(stop.container))
            assert stop.reached == pytest.approx(reached)
            assert 0 <= stop.probability <= 1
            at, reached = LocationId(stop.container), reached * (1 - stop.probability)

    def test_it_asks_for_nothing_when_nothing_is_left(self, searcher: SearchPolicy) -> None:
        empty = Belief(item_types=(MUG,), containers=(), probability=np.zeros((1, 0)), estimator="test")
        query = SearchQuery(
            item_type=MUG, origin=START, target=START, belief=empty, travel=toy_travel(), costs=SIMULATION_COSTS
        )
        assert searcher.order(query) == ()
        assert first_stop(searcher, query) is None

    def test_its_first_stop_alone_is_the_first_of_its_order(self, searcher: SearchPolicy) -> None:
        rng = np.random.default_rng(8)
        for _ in range(20):
            query = toy_query(dict(zip(ALL, rng.random(5), strict=True)))
            assert first_stop(searcher, query) == searcher.order(query)[0].container

    def test_the_same_question_has_the_same_answer(self, searcher: SearchPolicy) -> None:
        query = toy_query({BED: 0.3})
        assert searcher.order(query) == searcher.order(query)

    def test_it_looks_on_the_spot_first_where_the_robot_stands_by_a_likely_container(
        self, searcher: SearchPolicy
    ) -> None:
        query = toy_query({COUNTER: 0.9})
        here = SearchQuery(
            item_type=MUG,
            origin=LocationId(COUNTER),
            target=START,
            belief=query.belief,
            travel=query.travel,
            costs=SIMULATION_COSTS,
        )
        first = searcher.order(here)[0]
        assert (first.container, first.leg_m) == (COUNTER, 0.0)


def test_greedy_goes_from_nearest_to_nearest() -> None:
    order = [s.container for s in policy("greedy").order(toy_query({DESK: 0.9}))]
    assert order == [TABLE, FRIDGE, COUNTER, BED, DESK]


def test_most_probable_takes_the_nearer_of_equals() -> None:
    order = [s.container for s in policy("most-probable").order(toy_query({DESK: 0.9, TABLE: 0.2, FRIDGE: 0.2}))]
    assert order[:3] == [DESK, TABLE, FRIDGE]


def test_lios_looks_on_the_way_at_what_costs_little() -> None:
    """The counter is the likely place, 2 m away; the fridge lies 1 m beyond it and is worth a look from there."""
    order = [s.container for s in policy("lios").order(toy_query({COUNTER: 0.6, FRIDGE: 0.3}))]
    assert order[:2] == [COUNTER, FRIDGE]


def test_the_oracle_takes_the_nearest_instance_that_is_not_yet_searched() -> None:
    assert [s.container for s in oracle_policy(toy_house()).order(toy_query({}))] == [COUNTER]
    query = toy_query({})
    left = Belief(item_types=(MUG,), containers=(TABLE, DESK), probability=np.zeros((1, 2)), estimator="test")
    after = SearchQuery(
        item_type=MUG, origin=START, target=START, belief=left, travel=query.travel, costs=SIMULATION_COSTS
    )
    assert [s.container for s in oracle_policy(toy_house()).order(after)] == [DESK]


def test_candidates_by_worth_and_by_probability_differ() -> None:
    """One candidate: the paper keeps the nearest (by way there and back), ours the one worth its way."""
    query = toy_query({FRIDGE: 0.5, TABLE: 0.05})
    kept = {
        ranking: LeastExpectedCost(name="one", belief_model="exists", ranking=ranking, limit=1).order(query)
        for ranking in ("probable", "worth")
    }
    assert [s.container for s in kept["probable"]] == [TABLE]
    assert [s.container for s in kept["worth"]] == [FRIDGE]


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 5), st.integers(0, 10_000), st.sampled_from(["independent", "exists", "exclusive", "marginal"]))
@pytest.mark.slow
def test_the_full_tour_is_the_best_of_all_orders_where_that_can_be_checked(n: int, seed: int, model: str) -> None:
    query = random_query(n, seed=seed, search=0.5)
    here = search_space(query.belief, query.travel, origins=(START,), targets=(START,))
    least = min(
        order_cost(order, here, model=model, costs=query.costs).cost  # type: ignore[arg-type]
        for order in permutations(range(n))
    )
    tour = FullTour(belief_model=model, leading=min(n, 3)).search(query)  # type: ignore[arg-type]
    assert tour.cost >= least - 1e-9
    assert tour.cost <= least * 1.10 + 1e-9
    assert FullTour(belief_model=model).search(query).cost == pytest.approx(least, abs=1e-9)  # type: ignore[arg-type]


def test_the_full_tour_is_close_to_the_exact_one_over_fourteen() -> None:
    ratios = []
    for seed in range(12):
        query = random_query(14, seed=seed)
        exact = expected_search(query, belief_model="marginal", limit=14, ranking="worth").cost
        ratios.append(FullTour().search(query).cost / exact)
    assert min(ratios) >= 1 - 1e-9
    assert np.mean(ratios) < 1.005


def test_more_passes_never_cost_more_and_the_order_is_whole_at_any_time() -> None:
    query = random_query(25, seed=3)
    found = [FullTour(leading=4, passes=passes).search(query) for passes in (0, 1, 2, 20)]
    costs = [f.cost for f in found]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < costs[0]
    for search in found:
        assert sorted(s.container for s in search.stops) == sorted(query.belief.containers)
        assert search.missing == pytest.approx(0, abs=1e-12)


def test_the_full_tour_expects_what_its_stops_add_up_to() -> None:
    query = random_query(20, seed=5, search=1.0)
    search = FullTour().search(query)
    assert sum(search.partial_costs) == pytest.approx(search.cost)
    assert sum(s.reached * s.probability for s in search.stops) == pytest.approx(1.0)


def test_settings_that_cannot_be_are_refused() -> None:
    with pytest.raises(TooManyCandidates, match="full-lios"):
        LeastExpectedCost(name="x", belief_model="exists", ranking="worth", limit=30)
    with pytest.raises(BadValue, match="candidate limit"):
        FullTour(leading=0)
    with pytest.raises(BadValue, match="passes"):
        FullTour(passes=-1)


def test_policies_are_found_by_name_in_any_case() -> None:
    assert [policy(name).name for name in policy_names()] == list(policy_names())
    assert policy("LIOS").name == "lios"
    assert policy("lios") == LeastExpectedCost(name="lios", belief_model="independent", ranking="probable", limit=8)


def test_an_unknown_name_lists_the_nearest() -> None:
    with pytest.raises(UnknownName, match="conditioned-lios"):
        policy("conditioned-lois")


class Backwards:
    """A third party's policy: the last container first."""

    name = "backwards"

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        return order_cost(range(len(here.containers))[::-1], here, model="independent", costs=query.costs).stops


def test_a_third_partys_policy_comes_in_by_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint(name="backwards", value="test_policy:Backwards", group="lios.policies")
    monkeypatch.setattr(plugins, "_entries", lambda group, _: (entry,) if group == "lios.policies" else ())
    assert policy_names()[-1] == "backwards"
    assert [s.container for s in policy("backwards").order(toy_query({}))] == list(reversed(ALL))


def test_a_third_partys_policy_comes_in_by_module_and_name() -> None:
    assert policy("test_policy:Backwards", origin=NameOrigin.USER).name == "backwards"


@pytest.mark.parametrize("name", ["no_such_module:x", "test_policy:NotThere"])
def test_a_module_that_is_not_there_is_named(name: str) -> None:
    with pytest.raises(PluginNotLoaded, match=name.partition(":")[0]):
        policy(name, origin=NameOrigin.USER)


def test_something_that_is_no_policy_is_refused() -> None:
    with pytest.raises(PluginNotLoaded, match="order"):
        policy("test_policy:MUG", origin=NameOrigin.USER)


def test_policies_answer_to_the_papers_spelling() -> None:
    for name in ("ConditionedLIOS", "conditionedlios", " Conditioned-LIOS "):
        assert policy(name).name == "conditioned-lios"
    assert policy("LIOS").name == "lios"


@pytest.mark.parametrize("name", ["lios", "conditioned-lios"])
def test_many_beliefs_at_once_begin_where_each_would_begin(name: str) -> None:
    searcher = policy(name)
    assert isinstance(searcher, LeastExpectedCost)
    query = toy_query({DESK: 0.9})
    rng = np.random.default_rng(1)
    rows = rng.uniform(0, 1, size=(20, len(query.belief.containers)))
    each = [searcher.first(replace(query, belief=replace(query.belief, probability=row[None]))) for row in rows]
    assert searcher.firsts(query, rows) == set(each)
    assert len(set(each)) > 1
    assert searcher.firsts(query, rows[:1]) == {each[0]}
