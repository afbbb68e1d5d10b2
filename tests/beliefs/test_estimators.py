"""Properties of every estimator: finite, within [0, 1], independent of order, repeatable, sane for strange input."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import toy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.beliefs.counts import CountsEstimator
from workbench.beliefs.estimators import ESTIMATORS, estimator, shipped_weights
from workbench.beliefs.weights import read_weights
from workbench.errors import UnknownName
from workbench.evaluation.beliefs.metrics import dummy_travel_costs
from workbench.worlds.geometry import Pose
from workbench.worlds.house import Container, ContainerId, FloorPlan, Item, ItemId, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

ROOT = Path(__file__).resolve().parents[2]
NAMES = sorted(ESTIMATORS)
TYPES = ("Fridge", "CounterTop", "DiningTable", "Bed", "Desk", "Chair", "Toilet", "Sofa")
THINGS = ("Mug", "Egg", "Pillow", "Book", "RemoteControl", "ObjaLaptop", "Fork")


def thing(name: str, number: int) -> Item:
    return Item(id=ItemId(f"{name}|{number}"), type=ItemType(name))


def knowledge_of(plan: FloorPlan, contents: dict[ContainerId, tuple[Item, ...]]) -> Knowledge:
    return knowledge_at_start(plan, dummy_travel_costs(plan), contents)


@st.composite
def knowledges(draw: st.DrawFn) -> Knowledge:
    """A toy house with drawn furniture, some of it looked into."""
    plan = toy.toy_plan()
    kinds = draw(st.lists(st.sampled_from(TYPES), min_size=1, max_size=9))
    containers = tuple(
        Container(
            id=ContainerId(f"{kind}|{k}"),
            type=kind,
            room=plan.rooms[draw(st.integers(0, 1))].id,
            pose=Pose(x_m=1.0, y_m=1.0),
            size_m=(draw(st.floats(0.0, 5.0)), draw(st.floats(0.0, 5.0)), 1.0),
        )
        for k, kind in enumerate(kinds)
    )
    seen = draw(st.sets(st.integers(0, len(kinds) - 1), max_size=len(kinds)))
    contents = {
        containers[k].id: tuple(
            thing(name, 100 * k + n) for n, name in enumerate(draw(st.lists(st.sampled_from(THINGS), max_size=4)))
        )
        for k in sorted(seen)
    }
    return knowledge_of(replace(plan, containers=containers), contents)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(knowledge=knowledges(), data=st.data())
def test_a_belief_is_a_probability_and_does_not_depend_on_the_order_of_containers(
    name: str, knowledge: Knowledge, data: st.DataObject
) -> None:
    items = tuple(ItemType(t) for t in data.draw(st.lists(st.sampled_from(THINGS), unique=True, max_size=4)))
    belief = estimator(name).believe(knowledge, items)
    assert belief.containers == knowledge.unsearched
    assert belief.probability.shape == (len(items), len(knowledge.unsearched))
    assert np.isfinite(belief.probability).all()
    order = data.draw(st.permutations(knowledge.plan.containers))
    turned = replace(knowledge, plan=replace(knowledge.plan, containers=tuple(order)))
    other = estimator(name).believe(turned, items)
    columns = [other.containers.index(c) for c in belief.containers]
    assert np.abs(other.probability[:, columns] - belief.probability).max(initial=0.0) <= 2e-9


@pytest.mark.parametrize("name", NAMES)
def test_the_same_knowledge_gives_the_same_bytes_whatever_was_asked_before(name: str) -> None:
    house = toy.toy_house()
    knowledge = knowledge_of(house.plan, {toy.FRIDGE: house.contents[toy.FRIDGE]})
    items = house.item_types()
    first = estimator(name).believe(knowledge, items)
    one = ESTIMATORS[name](read_weights(shipped_weights(name)))
    for item in reversed(items):
        one.believe(knowledge, (item,))
    again = one.believe(knowledge, items)
    assert again.probability.tobytes() == first.probability.tobytes()
    assert again.estimator == first.estimator
    assert first.estimator.startswith(f"{name}@")


@pytest.mark.parametrize("name", NAMES)
def test_things_are_believed_to_be_where_they_are_kept(name: str) -> None:
    house = toy.toy_house()
    belief = estimator(name).believe(knowledge_of(house.plan, {}), (ItemType("Egg"), ItemType("Pillow")))
    if name != "people":  # nobody was asked about eggs
        assert belief.containers[int(np.argmax(belief.of(ItemType("Egg"))))] == toy.FRIDGE
    assert belief.containers[int(np.argmax(belief.of(ItemType("Pillow"))))] == toy.BED


@pytest.mark.parametrize("name", NAMES)
def test_a_house_of_a_single_container_and_one_with_nothing_left_to_search(name: str) -> None:
    plan = replace(toy.toy_plan(), containers=toy.toy_plan().containers[:1])
    alone = estimator(name).believe(knowledge_of(plan, {}), (ItemType("Mug"),))
    assert alone.probability.shape == (1, 1)
    searched = estimator(name).believe(knowledge_of(plan, {toy.FRIDGE: ()}), (ItemType("Mug"),))
    assert searched.probability.shape == (1, 0)
    assert estimator(name).believe(knowledge_of(plan, {}), ()).probability.shape == (0, 1)


@pytest.mark.parametrize("name", NAMES)
def test_shipped_weights_are_small(name: str) -> None:
    assert shipped_weights(name).stat().st_size < 5e6


def test_an_unknown_estimator_lists_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="best"):
        estimator("bset")


def test_finding_things_changes_what_best_believes_of_the_rest() -> None:
    house = toy.toy_house()
    items = (ItemType("Book"),)
    before = estimator("best").believe(knowledge_of(house.plan, {}), items)
    after = estimator("best").believe(knowledge_of(house.plan, {toy.BED: (), toy.DESK: ()}), items)
    shared = [before.containers.index(c) for c in after.containers]
    assert np.abs(after.probability - before.probability[:, shared]).max() > 0.01


@pytest.mark.ci
def test_believing_does_not_import_torch() -> None:
    code = (
        "import sys; sys.path.insert(0, 'tests'); import toy\n"
        "from workbench.beliefs.estimators import estimator\n"
        "from workbench.worlds.knowledge import knowledge_at_start\n"
        "k = knowledge_at_start(toy.toy_plan(), toy.toy_travel(), {})\n"
        "[estimator(n).believe(k, ('Mug',)) for n in ('counts', 'fcnn', 'best')]\n"
        "sys.exit('torch' in sys.modules)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False, cwd=ROOT).returncode == 0


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(knowledge=knowledges())
def test_counts_are_looked_up_by_room_container_and_item(knowledge: Knowledge) -> None:
    """Where the containers of a plan stand on the table's axes is kept; a name that the table lacks is in its last
    row."""
    counts, plan = estimator("counts"), knowledge.plan
    assert isinstance(counts, CountsEstimator)
    axes = [{name: i for i, name in enumerate(names)} for names in (counts.table.rooms, counts.table.containers)]
    for things in ((ItemType("Mug"), ItemType("NobodyKnows")), (ItemType("Egg"),)):
        probability = counts.believe(knowledge, things).probability
        for j, container in enumerate(map(plan.container, knowledge.unsearched)):
            names = plan.room(container.room).kind, container.type
            row = counts.table.probability[tuple(axis.get(n, -1) for axis, n in zip(axes, names, strict=True))]
            items = [counts.table.items.index(t) if t in counts.table.items else -1 for t in things]
            assert probability[:, j].tolist() == row[items].tolist()
