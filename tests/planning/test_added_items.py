"""Where a scenario's added items may be: equal probability over the containers left, by hand on the toy house."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from toy import COUNTER, FRIDGE, TABLE, toy_house, toy_plan, toy_travel

from replayers.runs.run import read
from workbench import cli
from workbench.beliefs.belief import Belief
from workbench.log_schema.task_json import task_from_json, task_to_json
from workbench.planning.scenarios.added_items import believe_scenario_items
from workbench.planning.scenarios.paper import COFFEE_ITEMS, make_task, with_scenario_items
from workbench.planning.tasks import Added
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

BOTTLE, MUG = ItemType("WaterBottle"), ItemType("Mug")
HOUSE = with_scenario_items("coffee", toy_house(), seed=3)
TASK = make_task("coffee", HOUSE, seed=3)


def believed(knowledge: Knowledge) -> Belief:
    """An estimator that knows no better: a tenth everywhere."""
    shape = (2, len(knowledge.unsearched))
    return Belief(
        item_types=(MUG, BOTTLE),
        containers=knowledge.unsearched,
        probability=np.full(shape, 0.1),
        estimator="even",
    )


def chances(knowledge: Knowledge, item_type: ItemType) -> dict[ContainerId, float]:
    told = believe_scenario_items(believed(knowledge), TASK, knowledge.plan)
    return {c: float(p) for c, p in zip(told.containers, told.of(item_type), strict=True) if p > 0}


def test_coffee_tells_where_it_puts_grinds_and_water() -> None:
    assert TASK.added == COFFEE_ITEMS
    assert make_task("breakfast", HOUSE, seed=3).added == ()


def test_what_the_house_had_is_left_to_the_estimator() -> None:
    contents = {
        c: tuple(replace(i, id=i.id.replace("added", "1")) for i in items) for c, items in HOUSE.contents.items()
    }
    own = replace(HOUSE, contents=contents)
    assert make_task("coffee", own, seed=3).added == ()


def test_chances_are_even_over_what_is_left() -> None:
    nothing_known = knowledge_at_start(toy_plan(), toy_travel(), {})
    assert chances(nothing_known, BOTTLE) == {FRIDGE: 0.5, TABLE: 0.5}
    assert chances(nothing_known.seen(FRIDGE, ()), BOTTLE) == {TABLE: 1.0}
    assert set(chances(nothing_known, MUG).values()) == {0.1}, "what was not added is believed as before"


def test_with_no_such_container_left_the_estimator_is_asked() -> None:
    searched = knowledge_at_start(toy_plan(), toy_travel(), {FRIDGE: (), TABLE: ()})
    assert set(chances(searched, BOTTLE).values()) == {0.1}
    assert COUNTER in chances(searched, BOTTLE)


def test_it_is_kept_with_the_task() -> None:
    assert task_from_json(task_to_json(TASK)) == TASK
    plain = replace(TASK, added=())
    assert b"added" not in task_to_json(plain), "tasks without additions are written as they were before"
    assert task_from_json(task_to_json(plain)) == plain


@pytest.mark.parametrize("strategy", ["model-lios", "conditioned-lios"])
def test_a_scenario_file_s_additions_are_believed_in_a_run(strategy: str, tmp_path: Path) -> None:
    scenario, log = tmp_path / "tea.yaml", tmp_path / "run.mcap"
    scenario.write_text(
        "name: tea\nadd:\n  - item: WaterBottle\n    in: [Fridge, Bed]\ngoal: {deliver: WaterBottle, to: start}\n"
    )
    words = ["record", "--task", str(scenario), "-s", strategy, "--known", "0", "-o", str(log)]
    assert cli.run(words) == 0
    run = read(log)
    assert run.task.added == (Added(item_type=BOTTLE, stands=("Fridge", "Bed")),)
    type_of = {c.id: c.type for c in run.place.plan.containers}
    first = run.beliefs[0]
    held = [p for c, p in zip(first.containers, first.probability[0], strict=True) if type_of[c] in ("Fridge", "Bed")]
    assert held == pytest.approx([1 / len(held)] * len(held), abs=1e-5)
    assert sum(first.probability[0]) == pytest.approx(1.0, abs=1e-5)
