"""What seeing in passing saves: searches as the closed loop makes them, and the rows of the curve."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from toy import toy_house

from recorders.simulated_run import Trial, trial_events
from workbench.beliefs.estimators import estimator
from workbench.cli import run as lios
from workbench.errors import BadValue
from workbench.evaluation.search.missed_looks import MissedLooks
from workbench.evaluation.search.seen_in_passing import Seeing, search_with_sight
from workbench.evaluation.search.sight_curve import (
    SightSearches,
    radii_named,
    searches_with_sight,
    sight_pairs,
    sight_rows,
)
from workbench.evaluation.search.strategies import strategy_of
from workbench.evaluation.search.trials import Beliefs, queries, search_trial
from workbench.execution.loop import outcome_of
from workbench.planning.tasks import find_task
from workbench.plugins import NameOrigin
from workbench.search.costs import ActionCosts
from workbench.search.policies.registry import policy
from workbench.worlds.house import START, House
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses
from workbench.worlds.sight.sightings import SightPaths

COSTS = ActionCosts(search=1.0)


@pytest.mark.ci_but(8)
@pytest.mark.parametrize("name", ["greedy", "conditioned-lios", "sight-lios"])
@pytest.mark.parametrize(("house", "radius_m"), [(toy_house(), 0.9), (toy_house(), 2.5), (None, 2.5)])
def test_a_search_costs_what_the_closed_loop_costs(name: str, house: House | None, radius_m: float) -> None:
    costs_the_same(name, house, radius_m, 0.0)


@pytest.mark.parametrize(
    ("name", "house", "radius_m", "rate"),
    [
        ("robust-lios", toy_house(), 1.6, 0.5),
        ("sight-lios", toy_house(), 1.6, 0.5),
        ("conditioned-lios", None, 2.5, 0.3),
    ],
)
def test_a_search_whose_looks_miss_costs_what_the_closed_loop_costs(
    name: str, house: House | None, radius_m: float, rate: float
) -> None:
    costs_the_same(name, house, radius_m, rate)


def costs_the_same(name: str, house: House | None, radius_m: float, rate: float) -> None:
    place = house or load_house(f"{shipped_houses()}:3")
    navigation = navigate(place.plan)
    travel = navigation.travel
    ways = SightPaths(place.plan, travel, navigation, radius_m)
    sought = queries(place, travel)[:: 3 if house else 25]
    beliefs = Beliefs(estimator("counts", origin=NameOrigin.USER), sought)
    for item in sought:
        seeing = Seeing(paths=ways, misses=MissedLooks(rate=rate, seed=11))
        searcher = policy(name, origin=NameOrigin.USER)
        made = search_with_sight(place, item, searcher, beliefs, costs=COSTS, seeing=seeing)
        planner = strategy_of(name)
        assert planner is not None
        trial = Trial(
            house=place,
            task=replace(find_task(item, START), available=(item,)),
            strategy=planner,
            estimator="counts",
            costs=COSTS,
            seed=11,
            sees_m=radius_m,
            miss_rate=rate,
        )
        ended = outcome_of(list(trial_events(trial)))
        assert made.found
        assert made.cost == pytest.approx(ended.cost), item
        assert len(made.order) == ended.searches, item


def test_a_radius_that_reaches_nothing_costs_what_no_sight_costs() -> None:
    house = toy_house()
    navigation = navigate(house.plan)
    beliefs = Beliefs(estimator("counts", origin=NameOrigin.USER), queries(house, navigation.travel))
    searcher = policy("conditioned-lios", origin=NameOrigin.USER)
    ways = SightPaths(house.plan, navigation.travel, navigation, 0.01)
    for item in queries(house, navigation.travel):
        plain = search_trial(house, navigation.travel, item, searcher, beliefs, costs=COSTS)
        seeing = search_with_sight(house, item, searcher, beliefs, costs=COSTS, seeing=Seeing(paths=ways))
        assert (seeing.cost, seeing.order) == (pytest.approx(plain.cost), plain.order)


def test_rows_are_paired_and_their_intervals_hold_the_shares() -> None:
    settings = SightSearches(policies=("greedy",), radii_m=(0.01, 2.5), estimator="counts")
    results = list(searches_with_sight([toy_house()], settings))
    costs = [cost for result in results for cost in result.costs]
    rows = sight_rows(costs, seed=0)
    assert sight_pairs(costs, seed=0) == []
    blind, seeing = rows
    assert (blind["sees_m"], seeing["sees_m"]) == (0.01, 2.5)
    assert blind["saved"] == pytest.approx(0.0)
    assert blind["cost_seeing"] == pytest.approx(blind["cost_without"]) == seeing["cost_without"]
    assert seeing["saved"] == pytest.approx(1 - seeing["cost_seeing"] / seeing["cost_without"])
    assert 0 < seeing["saved"] <= seeing["oracle_saves"]
    assert seeing["searches_seeing"] < seeing["searches_without"]


@pytest.mark.parametrize("text", ["", "0", "-1", "nan", "2,x", "1000"])
def test_bad_radii_are_refused(text: str) -> None:
    with pytest.raises(BadValue, match="--sees"):
        radii_named(text)


def test_radii_are_sorted_and_each_once() -> None:
    assert radii_named("4, 1,2.5,1") == (1.0, 2.5, 4.0)


def test_the_command_answers_and_refuses_what_does_not_go_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "evaluate",
        "search",
        "--queries",
        "2",
        "--sees",
        "2.5",
        "-p",
        "conditioned-lios",
        "--estimator",
        "counts",
    ]
    assert lios([*words, "--json", "-o", str(tmp_path)]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["policy"] for row in answer["rows"]] == ["greedy", "conditioned-lios"]
    (pair,), (first, second) = answer["pairs"], answer["rows"]
    assert (pair["a"], pair["b"], pair["sees_m"]) == ("greedy", "conditioned-lios", 2.5)
    assert pair["b_saves_of_a"] == pytest.approx(1 - second["cost_seeing"] / first["cost_seeing"])
    assert json.loads((tmp_path / "sight.json").read_text()) == answer
    assert lios([*words, "-o", str(tmp_path)]) == 2
    assert lios([*words, "--record", "-o", str(tmp_path / "more")]) == 2
    assert "without" in capsys.readouterr().err
    assert lios([*words, "--miss-rate", "0.3", "--json"]) == 0
    missed = json.loads(capsys.readouterr().out)
    assert (answer["miss_rate"], missed["miss_rate"]) == (0.0, 0.3)
    assert all(row["cost_seeing"] >= row["cost_oracle"] for row in missed["rows"])
