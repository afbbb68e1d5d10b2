"""Marks of items: on their furniture, apart from each other, named where names can be read."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest
from toy import COUNTER, FRIDGE, toy_plan
from toy_run import ns, toy_run

from dashboards.model.containers.item_marks import MAX_MARKS, MAX_NAMES, item_marks
from dashboards.model.containers.item_spots import item_spots
from dashboards.model.containers.seen_items import ItemPlace, items_seen
from dashboards.model.timeline import timeline_of

PLAN = toy_plan()
INDEX = {c.id: i for i, c in enumerate(PLAN.containers)}


@pytest.mark.parametrize("count", [1, 2, 7, 48])
def test_spots_lie_on_the_top_and_apart(count: int) -> None:
    for container in PLAN.containers:
        at, size_m = item_spots(container, count)
        pose, (wide, deep, high) = container.pose, container.size_m
        c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
        x, y = at[:, 0] - pose.x_m, at[:, 1] - pose.y_m
        assert np.all(np.abs(c * x + s * y) <= max(wide, 0.2) / 2)
        assert np.all(np.abs(-s * x + c * y) <= max(deep, 0.2) / 2)
        assert np.allclose(at[:, 2], container.base_m + high + size_m / 2, atol=1e-4)
        if count > 1:
            gaps = np.linalg.norm(at[:, None] - at[None], axis=2) + 9 * np.eye(count)
            assert gaps.min() > size_m * 0.9


def test_the_goal_is_named_and_the_rest_only_in_the_opened_container() -> None:
    seen = items_seen(timeline_of(toy_run()), ns(7))
    closed = item_marks(PLAN, seen, named=(), focus="Plate")
    assert sorted(words for words, _ in closed.names) == ["mug", "plate"]
    opened = item_marks(PLAN, seen, named=(INDEX[COUNTER],), focus="")
    assert sorted(words for words, _ in opened.names) == ["mug", "pot"]
    assert len(closed.centre) == len(opened.centre) == len(seen)
    assert closed.wanted.tolist() == [p.wanted for p in seen]


def test_several_of_a_type_are_counted_and_many_types_bounded() -> None:
    eggs = [ItemPlace(item=f"Egg|{i}", item_type="Egg", container=INDEX[FRIDGE], wanted=True) for i in range(3)]
    assert item_marks(PLAN, eggs, named=(), focus="").names[0][0] == "egg x 3"
    kinds = [ItemPlace(item=f"K{i}", item_type=f"K{i:04}", container=INDEX[FRIDGE], wanted=True) for i in range(1000)]
    marks = item_marks(PLAN, kinds, named=(), focus="")
    assert len(marks.centre) == MAX_MARKS
    assert marks.names[0][0].endswith(f"+ {MAX_MARKS - 3}")
    assert len(item_marks(PLAN, kinds, named=(INDEX[FRIDGE],), focus="").names) == MAX_NAMES


def test_nothing_seen_is_nothing_drawn() -> None:
    marks = item_marks(PLAN, (), named=(), focus="")
    assert marks.centre.shape == (0, 3)
    assert marks.names == ()
