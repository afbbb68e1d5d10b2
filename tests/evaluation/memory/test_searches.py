"""The memory experiment on searches of shipped houses: the same twice, and what must hold in every house."""

from __future__ import annotations

import json

import pytest

from workbench.beliefs.memory.move_rates import shipped_rates
from workbench.cli import run as lios
from workbench.evaluation.memory.searches import MemorySearches, remembered_searches
from workbench.evaluation.search.trials import queries
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_house


def test_memory_saves_where_nothing_moved_and_is_forgotten_after_two_months() -> None:
    houses = [load_house("houses:0")]
    asked = {houses[0].plan.name: queries(houses[0], navigate(houses[0].plan).travel)[:8]}
    settings = MemorySearches(policies=("conditioned-lios",), rates=shipped_rates(), estimator="counts", asked=asked)
    found = [c for house in remembered_searches(houses, settings) for c in house.costs]
    assert found == [c for house in remembered_searches(houses, settings) for c in house.costs]
    sums = {
        name: [sum(getattr(c, what) for c in found if c.condition == name) for what in ("without", "remembered")]
        for name in dict.fromkeys(c.condition for c in found)
    }
    assert sums["nothing moved"][1] < sums["nothing moved"][0]
    assert sums["all moved, in two months"][1] == pytest.approx(sums["all moved, in two months"][0], rel=0.03)
    assert all(c.oracle <= min(c.without, c.remembered, c.up_to_date) + 1e-9 for c in found)
    still = [c for c in found if c.condition == "nothing moved"]
    assert sum(c.up_to_date for c in still) < sum(c.without for c in still)


def test_the_command_prints_the_table_and_refuses_what_does_not_fit(capsys: pytest.CaptureFixture[str]) -> None:
    said = ["evaluate", "search", "--memory", "--queries", "3", "--estimator", "counts"]
    assert lios([*said, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["rows"][0]["condition"] == "nothing moved"
    assert {row["strategy"] for row in answer["rows"]} == {"conditioned-lios"}
    assert lios([*said, "--folds", "2"]) == 2
    assert lios(["evaluate", "search", "--queries", "3", "--rates", "none.csv"]) == 2
    assert lios([*said, "--rates", "none.csv"]) == 2
    assert len([line for line in capsys.readouterr().err.splitlines() if line.startswith("lios: ")]) == 3
