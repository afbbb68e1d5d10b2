"""Scenarios are seeded, ask only for what a house has, and refuse with a reason."""

from __future__ import annotations

from pathlib import Path

import pytest
from toy import DESK, TABLE, toy_house, toy_travel

from workbench.errors import BadValue, MalformedFile, UnknownName
from workbench.planning.scenarios.house_items import ScenarioUnsupported
from workbench.planning.scenarios.paper import (
    SCENARIOS,
    family_of,
    make_task,
    scenario_name,
    with_scenario_items,
)
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Holding
from workbench.worlds.house import START, House, ItemType, LocationId

COFFEE_HOUSE = with_scenario_items("coffee", toy_house(), seed=3)


@pytest.mark.parametrize("scenario", [*SCENARIOS, "find", "deliver-5", "any-of-4"])
def test_same_seed_same_task(scenario: str) -> None:
    house = with_scenario_items(scenario, toy_house(), seed=5)
    task = make_task(scenario, house, seed=5, travel=toy_travel())
    assert task == make_task(
        scenario, with_scenario_items(scenario, toy_house(), seed=5), seed=5, travel=toy_travel()
    )
    assert task.failure_cost == {"any-of": 100.0, "coffee": 450.0, "breakfast+coffee": 450.0}.get(
        family_of(scenario)[0], 400.0
    )
    assert set(task.available) == set(house.item_types())


def test_deliver_asks_for_other_places_than_those_that_hold_it() -> None:
    house = toy_house()
    for seed in range(20):
        goal = make_task("deliver-3", house, seed=seed).goal
        assert isinstance(goal, AllOf)
        for part in goal.parts:
            assert isinstance(part, Delivered)
            assert part.at not in house.holders(part.item_type)
        assert len({part.at for part in goal.parts if isinstance(part, Delivered)}) == 3


def test_breakfast_has_the_paper_s_ways() -> None:
    goal = make_task("breakfast", toy_house(), seed=0).goal
    assert isinstance(goal, AnyOf)
    foods = [part.parts[0] for part in goal.parts if isinstance(part, AllOf)]
    assert [(f.item_type, f.properties) for f in foods if isinstance(f, Delivered)] == [
        ("Egg", ("boiled",)),
        ("Apple", ("peeled",)),
        ("Tomato", ("peeled",)),
        ("Bread", ("toasted",)),
    ]


def test_coffee_adds_grinds_and_water_once() -> None:
    assert len(COFFEE_HOUSE.holders(ItemType("CoffeeGrinds"))) == 1
    assert len(COFFEE_HOUSE.holders(ItemType("WaterBottle"))) == 1
    assert with_scenario_items("coffee", COFFEE_HOUSE, seed=9) == COFFEE_HOUSE


def test_what_cannot_be_reached_is_not_asked_for() -> None:
    from dataclasses import replace

    travel = replace(toy_travel(), locations=toy_travel().locations[:-1], metres=toy_travel().metres[:-1, :-1])
    for seed in range(10):
        task = make_task("deliver-3", toy_house(), seed=seed, travel=travel)
        assert "CellPhone" not in task.available
        assert DESK not in [part.at for part in task.goal.parts if isinstance(part, Delivered)]  # type: ignore[union-attr]


def test_a_house_without_a_kitchen_is_refused_by_name() -> None:
    bare = House(plan=toy_house().plan, contents={DESK: toy_house().contents[DESK]})
    with pytest.raises(ScenarioUnsupported, match="toy cannot support breakfast: it has nothing that breakfast"):
        make_task("breakfast", bare, seed=0)
    with pytest.raises(ScenarioUnsupported, match="no coffee grinds"):
        make_task("coffee", toy_house(), seed=0)


def test_names() -> None:
    assert scenario_name("Any-of-3") == "any-of-three"
    assert scenario_name("deliver-three") == "deliver-3"
    with pytest.raises(UnknownName, match="deliver-3"):
        scenario_name("delivr-3")
    with pytest.raises(BadValue):
        scenario_name("deliver-99")


GOOD = """\
name: tea-time
title: toast and something to drink from
failure_cost: 300
add:
  - item: WaterBottle
    in: [Fridge, DiningTable]
goal:
  all:
    - deliver: bread
      to: serving
      with: [toasted]
    - any:
        - deliver: Mug
          to: serving
        - hold: cell phone
          to: start
"""


def test_a_file_sets_a_task(tmp_path: Path) -> None:
    path = tmp_path / "tea.yaml"
    path.write_text(GOOD)
    house = with_scenario_items(str(path), toy_house(), seed=1)
    assert house.holders(ItemType("WaterBottle"))
    task = make_task(str(path), house, seed=1)
    assert (task.scenario, task.failure_cost, task.budget_s) == ("tea-time", 300.0, 120.0)
    bread = Delivered(item_type=ItemType("Bread"), at=LocationId(TABLE), properties=("toasted",))
    mug = Delivered(item_type=ItemType("Mug"), at=LocationId(TABLE))
    phone = Holding(item_type=ItemType("CellPhone"), at=START)
    assert task.goal == AllOf(parts=(bread, AnyOf(parts=(mug, phone))))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("failure_cost", "failure_csot", r"tea.yaml:3:1: unknown key 'failure_csot'"),
        (
            "bread",
            "7",
            r"tea.yaml:9:16: no item type '7'\. Known are: .*, and \d+ more, which '\?' lists\. Correct the name\.",
        ),
        ("bread", "brad", r"tea.yaml:9:16: no item type 'brad'.*bread"),
        ("toasted", "boiled", r"tea.yaml:11:14: nothing makes a bread boiled. Known for it: toasted"),
        ("300", "-3", r"tea.yaml:3:15: failure_cost is '-3'"),
        ("goal:", "gaol:", r"tea.yaml:7:1: unknown key 'gaol'"),
        ("        - hold", "       - hold", r"tea.yaml:1[45]:\d+: no YAML"),
        ("to: start", "to: nowhere", r"tea.yaml:16:15: no container type 'nowhere'"),
    ],
)
def test_a_typo_is_named_with_line_and_column(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "tea.yaml"
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(MalformedFile, match=said):
        make_task(str(path), toy_house(), seed=1)


@pytest.mark.parametrize("text", ["", "goal: 3", "- a\n- b", "goal:\n  all: []", "\x00", "goal: &a [*a]"])
def test_nonsense_files_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(MalformedFile, match=r"x\.yaml"):
        make_task(str(path), toy_house(), seed=1)


def _bomb(kind: str) -> str:
    """Nine aliases of nine aliases of ..., eight deep: 43 million goals on one line."""
    goal = "&a0 {deliver: Mug, to: start}"
    for i in range(1, 9):
        goal = f"&a{i} {{{kind}: [{goal}{f', *a{i - 1}' * 8}]}}"
    return f"goal: {goal}\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (_bomb("any"), r"x\.yaml:1:\d+: these are more than 1000 goals, aliases counted"),
        (_bomb("all"), r"x\.yaml:1:\d+: these are more than 1000 goals, aliases counted"),
        ("goal:\n  all: [{deliver: Mug, to: start}]\n  to: start", r"x\.yaml:3:3: 'to' says nothing beside all"),
        ("goal: {hold: Bread, to: start, with: [toasted]}", r"x\.yaml:1:32: 'with' says nothing beside hold"),
        ("add: [{item: Mug, in: []}]\ngoal: {hold: Mug, to: start}", r"x\.yaml:1:23: in has no container types"),
        ("failure_cost: [1]\ngoal: {hold: Mug, to: start}", r"x\.yaml:1:15: failure_cost is not a number"),
        ('title: "a\\n\\e[31mb"\ngoal: {hold: Mug, to: start}', r"x\.yaml:1:8: .* cannot be printed on one line"),
        ('goal: {hold: "Mug\\0", to: start}', r"x\.yaml:1:14: 'Mug.x00' cannot be printed"),
        ("goal: {deliver: Toaster, to: start, with: [tosted]}", r"x\.yaml:1:44: nothing makes a toaster tosted"),
    ],
)
def test_what_a_file_says_in_vain_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(text)
    with pytest.raises(MalformedFile, match=said):
        make_task(str(path), toy_house(), seed=1)


@pytest.mark.parametrize(
    ("goal", "lacks"),
    [
        ("{deliver: Teddy Bear, to: start}", "no teddy bear"),
        ("{any: [{hold: Teddy Bear, to: start}, {hold: Laptop, to: start}]}", "no teddy bear"),
        ("{all: [{deliver: Bread, to: start}, {deliver: Bread, to: serving}]}", "1 bread, and the goal asks for 2"),
        ("{deliver: Mug, to: start, with: [coffee]}", "nothing that makes a mug coffee"),
    ],
)
def test_a_house_that_cannot_meet_a_file_s_goal_is_refused(tmp_path: Path, goal: str, lacks: str) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(f"goal: {goal}\n")
    with pytest.raises(ScenarioUnsupported, match=f"toy cannot support x: it has {lacks}"):
        make_task(str(path), toy_house(), seed=1)


def test_an_alternative_that_the_house_lacks_does_not_matter(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text("goal: {any: [{deliver: Teddy Bear, to: start}, {deliver: Mug, to: start}]}\n")
    task = make_task(str(path), toy_house(), seed=1)
    assert isinstance(task.goal, AnyOf)
    assert len(task.goal.parts) == 2
    assert "TeddyBear" not in task.available


def test_a_file_asks_only_for_what_can_be_reached(tmp_path: Path) -> None:
    from dataclasses import replace

    travel = replace(toy_travel(), locations=toy_travel().locations[:-1], metres=toy_travel().metres[:-1, :-1])
    path = tmp_path / "x.yaml"
    path.write_text("goal: {deliver: CellPhone, to: start}\n")
    assert "CellPhone" in make_task(str(path), toy_house(), seed=1, travel=toy_travel()).available
    with pytest.raises(ScenarioUnsupported, match="no cell phone"):
        make_task(str(path), toy_house(), seed=1, travel=travel)
