"""The beliefs of `best` that other items in searched containers can lead to include every one that they lead to."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.beliefs.best import BestEstimator
from workbench.beliefs.context import ALIKE, FULL_HOUSE, FULL_ROOM, FULL_TYPE, features
from workbench.beliefs.estimators import estimator
from workbench.beliefs.observed_scene import scene_of
from workbench.evaluation.beliefs.metrics import dummy_travel_costs
from workbench.worlds.house import House, Item, ItemId, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses

ASKED = (ItemType("Mug"), ItemType("Pillow"))


@pytest.fixture(scope="module")
def house() -> House:
    return load_houses(shipped_houses())[0]


@pytest.fixture(scope="module")
def best() -> BestEstimator:
    made = estimator("best")
    assert isinstance(made, BestEstimator)
    return made


def knowledge_of(house: House, contents: dict[str, list[str]]) -> Knowledge:
    known = {
        c.id: tuple(Item(id=ItemId(f"{t}|{c.id}|{k}"), type=ItemType(t)) for k, t in enumerate(contents[c.id]))
        for c in house.plan.containers
        if c.id in contents
    }
    return knowledge_at_start(house.plan, dummy_travel_costs(house.plan), known)


@pytest.mark.parametrize(("opened", "asked"), [(1, ASKED), (2, ASKED[:1]), (3, ASKED[1:])])
def test_no_other_contents_lead_to_another_belief(
    house: House, best: BestEstimator, opened: int, asked: tuple[ItemType, ...]
) -> None:
    rng = np.random.default_rng(opened)
    others = [t for t in best.names.placements.items if t not in asked]
    containers = [c.id for c in house.plan.containers]
    for _ in range(2):
        searched = [containers[i] for i in rng.permutation(len(containers))[: opened + 2]]
        told = {c: [str(t) for t in asked if rng.random() < 0.2] for c in searched}
        partly = searched[:opened]
        plain = knowledge_of(house, told)
        possible = best.beliefs_whatever_else(plain, asked, partly, at_most=10**6)
        assert possible is not None
        tables = {b.probability.tobytes() for b in possible}
        assert best.believe(plain, asked).probability.tobytes() in tables
        for most in (1, 2, 5, 12, 40) * 3:
            counts = rng.integers(most + 1, size=len(partly))
            more = {
                c: [*told[c], *rng.choice(others, size=n, replace=False)] for c, n in zip(partly, counts, strict=True)
            }
            believed = best.believe(knowledge_of(house, told | more), asked)
            assert believed.probability.tobytes() in tables


def test_a_second_item_of_a_type_in_one_container_changes_no_belief(house: House, best: BestEstimator) -> None:
    first, second, third = (c.id for c in house.plan.containers[:3])
    once = {first: [str(ASKED[0]), "Vase"], second: [], third: [str(ASKED[1])]}
    for container, more in ((first, str(ASKED[0])), (first, "Vase"), (third, str(ASKED[1]))):
        twice = once | {container: [*once[container], more]}
        believed = [best.believe(knowledge_of(house, told), ASKED).probability for told in (once, twice)]
        np.testing.assert_array_equal(*believed)


def test_other_items_raise_four_features_and_change_no_other(house: House, best: BestEstimator) -> None:
    first, second = (c.id for c in house.plan.containers[:2])
    tables = []
    for contents in ({first: [], second: ["Vase"]}, {first: ["Book", "Candle", "Cup"], second: ["Vase"]}):
        scene = scene_of(knowledge_of(house, contents))
        tables.append(features(scene, ASKED, best.names.opinions(scene, ASKED)))
    before, after = tables
    changed = {int(k) for k in np.flatnonzero((before != after).any(axis=(1, 2)))}
    assert {FULL_HOUSE, FULL_ROOM} <= changed <= {ALIKE, FULL_ROOM, FULL_TYPE, FULL_HOUSE}
    assert (after >= before).all()


def test_there_is_one_belief_where_nothing_is_partly_known_and_none_where_there_are_too_many(
    house: House, best: BestEstimator
) -> None:
    knowledge = knowledge_of(house, {house.plan.containers[0].id: []})
    (only,) = best.beliefs_whatever_else(knowledge, ASKED, (), at_most=1) or ()
    assert only.probability.tobytes() == best.believe(knowledge, ASKED).probability.tobytes()
    assert best.beliefs_whatever_else(knowledge, ASKED, [house.plan.containers[0].id], at_most=1) is None
    everything = knowledge_of(house, {c.id: [] for c in house.plan.containers})
    assert len(best.beliefs_whatever_else(everything, ASKED, [house.plan.containers[0].id], at_most=1) or ()) == 1


def test_what_other_items_raise_is_counted_together(house: House, best: BestEstimator) -> None:
    """One number of items in one container decides on all that is fuller, and without any nothing is more alike."""
    mug, container = ASKED[:1], house.plan.containers[2].id
    beliefs = best.beliefs_whatever_else(knowledge_of(house, {container: []}), mug, [container], at_most=10**6)
    house_wide, room, kind, alike = (
        len(np.unique(best.trees.threshold[best.trees.feature == k]))
        for k in (FULL_HOUSE, FULL_ROOM, FULL_TYPE, ALIKE)
    )
    assert beliefs is not None
    assert len(beliefs) <= 1 + (house_wide + room + kind + 1) * (1 + alike)
