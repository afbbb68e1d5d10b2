"""The object-search experiment: trials worked out by hand, and compared with the ordinary closed loop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from toy import COUNTER, DESK, FRIDGE, TABLE, toy_house, toy_travel

from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.estimators import estimator
from workbench.errors import BadValue, UnknownName
from workbench.evaluation.search.calibration import look_calibration
from workbench.evaluation.search.experiment import Experiment, draw_queries, policies_named, run_experiment
from workbench.evaluation.search.strategies import strategy_of, with_policy
from workbench.evaluation.search.table import costs_of, pairs, rows, rows_by_kind
from workbench.evaluation.search.trials import Beliefs, SearchTrial, house_trials, queries, search_trial
from workbench.execution.loop import outcome_of, run_task
from workbench.planning.strategies import strategy
from workbench.planning.tasks import find_task
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.policies.registry import policy, policy_names
from workbench.worlds.house import START, ContainerId, House, ItemType
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_house
from workbench.worlds.simulated import SimulatedWorld

PHONE, MUG = ItemType("CellPhone"), ItemType("Mug")


class Told:
    """An estimator that believes what it is told of each container, and counts how often it is asked."""

    name = "told"

    def __init__(self, chances: dict[ContainerId, float]) -> None:
        self.chances, self.asked = chances, 0

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        self.asked += 1
        row = [self.chances.get(c, 0.01) for c in knowledge.unsearched]
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.tile(row, (len(item_types), 1)),
            estimator=self.name,
        )


def trial(name: str, item: ItemType, told: Told) -> SearchTrial:
    house = toy_house()
    return search_trial(
        house, toy_travel(), item, policy(name), Beliefs(told, house.item_types()), costs=SIMULATION_COSTS
    )


def test_greedy_walks_the_toy_house_from_nearest_to_nearest() -> None:
    """Table 1, fridge 3, counter 1, and there is the mug: pick 5, back 2."""
    found = trial("greedy", MUG, Told({}))
    assert found.order == (TABLE, FRIDGE, COUNTER)
    assert found.cost == pytest.approx(1 + 3 + 1 + 5 + 2)


def test_the_most_probable_is_walked_to_however_far() -> None:
    found = trial("most-probable", PHONE, Told({DESK: 0.9, TABLE: 0.5}))
    assert found.order == (DESK,)
    assert found.cost == pytest.approx(7 + 5 + 7)


def test_lios_is_wrong_where_its_belief_is_wrong_and_goes_on() -> None:
    found = trial("lios", PHONE, Told({FRIDGE: 0.9}))
    assert found.order[0] == FRIDGE
    assert found.order[-1] == DESK
    assert found.predicted is not None


def test_every_look_keeps_what_was_believed_of_it_and_whether_it_found() -> None:
    """Twice the fridge is believed in first, where no phone is; then the desk, where it is."""
    beliefs = ({FRIDGE: 0.9}, {FRIDGE: 0.8}, {DESK: 0.7})
    trials = [trial("most-probable", PHONE, Told(chances)) for chances in beliefs]
    assert [t.said[0] for t in trials] == [0.9, 0.8, 0.7]
    assert all(len(t.said) == len(t.order) for t in trials)
    first = next(row for row in look_calibration(trials) if row["look"] == 1)
    assert [first[k] for k in ("policy", "kind", "queries")] == ["most-probable", "ai2-thor", 3]
    assert first["said"] == pytest.approx(0.8)
    assert first["found"] == pytest.approx(1 / 3)
    greedy = house_trials(
        toy_house(), toy_travel(), policies=("greedy",), estimators=lambda _: Told({}), costs=SIMULATION_COSTS
    )
    assert all(t.said == () for t in greedy), "greedy is asked for no belief"


def test_the_oracle_goes_to_the_nearest_of_two_mugs() -> None:
    trials = house_trials(
        toy_house(), toy_travel(), policies=("oracle",), estimators=lambda _: Told({}), costs=SIMULATION_COSTS
    )
    mug = next(t for t in trials if t.item_type == MUG)
    assert (mug.order, mug.cost) == ((COUNTER,), 2 + 5 + 2)


def test_every_item_type_in_a_container_is_a_query() -> None:
    assert queries(toy_house(), toy_travel()) == toy_house().item_types()


def test_queries_that_saw_the_same_share_a_belief() -> None:
    told = Told({})
    house = toy_house()
    beliefs = Beliefs(told, house.item_types())
    for _ in range(2):
        for item in house.item_types():
            search_trial(house, toy_travel(), item, policy("lios"), beliefs, costs=SIMULATION_COSTS)
    assert told.asked < sum(1 + 4 for _ in house.item_types())
    again = told.asked
    search_trial(house, toy_travel(), MUG, policy("lios"), beliefs, costs=SIMULATION_COSTS)
    assert told.asked == again


def test_an_item_that_the_house_does_not_hold_is_no_trial() -> None:
    with pytest.raises(ValueError, match="no Piano"):
        trial("greedy", ItemType("Piano"), Told({}))


def in_the_loop(house: House, item: ItemType, name: str, believer: Estimator) -> float:
    """The same query through the ordinary closed loop in a simulated world."""
    navigation = navigate(house.plan)
    known = strategy_of(name)
    planner = with_policy(name) if known is None else strategy(known, house=house)
    events = list(
        run_task(SimulatedWorld(house, navigation), planner, believer, find_task(item, START), costs=SIMULATION_COSTS)
    )
    end = outcome_of(events)
    assert end.status == "done"
    return end.cost


@pytest.mark.parametrize("name", [*policy_names(), "oracle"])
def test_the_closed_loop_gives_the_same_cost(name: str, procthor: Path) -> None:
    house = load_house(f"{procthor / 'multi_room_train.jsonl.gz'}:87")
    travel = navigate(house.plan).travel
    believer = estimator("counts")
    asked = queries(house, travel)[::9]
    assert len(asked) >= 4
    trials = house_trials(
        house,
        travel,
        policies=(name,),
        estimators=lambda _: believer,
        costs=SIMULATION_COSTS,
        item_types=asked,
    )
    for found in trials:
        assert found.cost == pytest.approx(in_the_loop(house, found.item_type, name, believer), abs=1e-9)


def toy_trials() -> list[SearchTrial]:
    """Three queries in two houses under greedy, lios and the oracle."""
    costs = {"greedy": (20.0, 30.0, 10.0), "lios": (14.0, 18.0, 12.0), "oracle": (10.0, 10.0, 10.0)}
    asked = (("a", "Mug"), ("a", "ObjaClock"), ("b", "Mug"))
    return [
        SearchTrial(
            house=house,
            item_type=ItemType(item),
            policy=name,
            cost=cost,
            order=(ContainerId("c"),) * (2 if name == "greedy" else 1),
            predicted=cost - 1 if name == "lios" else None,
        )
        for name, values in costs.items()
        for (house, item), cost in zip(asked, values, strict=True)
    ]


def test_the_table_states_both_forms_of_improvement() -> None:
    """Greedy 20 on average, lios 44/3, the oracle 10: saves 16/60, Greedy costs 16/44 more, closes 16/30."""
    row = next(r for r in rows(costs_of(toy_trials()), seed=1) if r["policy"] == "lios")
    assert row["mean_cost"] == pytest.approx(44 / 3)
    assert row["saved_of_greedy"] == pytest.approx(16 / 60)
    assert row["greedy_costs_more"] == pytest.approx(16 / 44)
    assert row["oracle_gap_closed"] == pytest.approx(16 / 30)
    assert row["worse_than_greedy"] == pytest.approx(1 / 3)
    assert row["realised_over_predicted"] == pytest.approx(44 / 41)
    assert row["searches"] == 1
    assert (row["queries"], row["houses"]) == (3, 2)
    assert row["ci95"][0] <= row["mean_cost"] <= row["ci95"][1]


def test_kinds_of_item_have_rows_of_their_own() -> None:
    by_kind = rows_by_kind(costs_of(toy_trials()), seed=1)
    clock = next(r for r in by_kind if (r["kind"], r["policy"]) == ("objaverse", "lios"))
    assert (clock["queries"], clock["mean_cost"]) == (1, 18.0)


def test_pairs_are_differences_of_the_same_queries() -> None:
    pair = next(p for p in pairs(costs_of(toy_trials()), seed=1) if (p["a"], p["b"]) == ("greedy", "lios"))
    assert pair["b_minus_a"] == pytest.approx(-16 / 3)
    assert pair["share_of_greedy"] == pytest.approx(-16 / 60)
    assert (pair["b_costs_more"], pair["b_costs_less"]) == (pytest.approx(1 / 3), pytest.approx(2 / 3))


def test_a_table_needs_every_policy_on_every_query() -> None:
    with pytest.raises(BadValue, match="every policy and query"):
        costs_of(toy_trials()[:-1])


def test_all_policies_stand_between_greedy_and_the_oracle() -> None:
    assert policies_named(["all"]) == ("greedy", *policy_names()[1:], "oracle")
    assert policies_named(["LIOS"]) == ("greedy", "lios", "oracle")
    with pytest.raises(UnknownName, match="lios"):
        policies_named(["lioss"])


def counts(*names: str) -> Experiment:
    return Experiment(policies=policies_named(names), estimator="counts", paper_estimator="counts")


def test_drawn_queries_are_the_same_for_the_same_seed_and_no_more_than_asked_for() -> None:
    houses = [toy_house()]
    asked = draw_queries(houses, 3, rng=np.random.default_rng(4))
    assert asked == draw_queries(houses, 3, rng=np.random.default_rng(4))
    assert sum(len(items) for items in asked.values()) == 3
    with pytest.raises(BadValue, match="at least 1"):
        draw_queries(houses, 0, rng=np.random.default_rng(4))


def test_an_experiment_runs_the_queries_that_were_drawn() -> None:
    asked = {"toy": (MUG,)}
    (result,) = run_experiment(counts("lios"), [toy_house()], asked=asked)
    assert [t.policy for t in result.trials] == ["greedy", "lios", "oracle"]
    assert {t.item_type for t in result.trials} == {MUG}
    assert list(run_experiment(counts("lios"), [toy_house()], asked={})) == []


@pytest.mark.slow
def test_workers_change_nothing_but_the_time() -> None:
    def costs(workers: int) -> list[float]:
        results = run_experiment(counts("conditioned-lios"), [toy_house()], workers=workers)
        return [t.cost for r in results for t in r.trials]

    assert costs(1) == costs(2)


def test_no_workers_are_refused() -> None:
    with pytest.raises(BadValue, match="workers"):
        list(run_experiment(counts("lios"), [toy_house()], workers=0))


def test_what_is_loaded_once_is_loaded_before_any_clock_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    told, warmed = Told({}), list[int]()
    monkeypatch.setattr("workbench.evaluation.search.trials.warm_up", lambda *_: warmed.append(told.asked))
    house_trials(
        toy_house(), toy_travel(), policies=("greedy", "lios"), estimators=lambda _: told, costs=SIMULATION_COSTS
    )
    assert warmed == [0]
    assert told.asked > 0
