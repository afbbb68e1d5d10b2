"""What is left of a belief after looks that may have missed the item, by hand, and how the tab says so."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import pytest
from toy import COUNTER, DESK, toy_plan
from toy_run import ns, stamp, toy_run

from dashboards.model.clock import Clock
from dashboards.model.containers.container_history import container_history
from dashboards.model.containers.fruitless_looks import FruitlessLooks, fruitless_looks
from dashboards.model.timeline import Timeline, timeline_of
from dashboards.panels.container import container
from workbench.log_schema.events import HowLooked, Observation, SeenItem

INDEX = {c.id: i for i, c in enumerate(toy_plan().containers)}


def missing(*looks: tuple[float, str, tuple[str, ...]], p_detect: float = 0.8) -> Timeline:
    """The toy run, in which the counter is believed to hold a mug with 0.3, with looks that can miss."""
    run = toy_run()
    one = next(o for o in run.observations if o.container == COUNTER)
    made: list[Observation] = []
    for number, (second, where, items) in enumerate(looks):
        how = HowLooked(number=number + 1, item_types=("Mug",), p_detect=(p_detect,))
        seen = tuple(SeenItem(id=f"{t}|1", type=t) for t in items)
        made.append(msgspec.structs.replace(one, stamp=stamp(second), container=where, items=seen, look=how))
    others = tuple(o for o in run.observations if o.container != COUNTER)
    return timeline_of(replace(run, observations=(*others, *made)))


def told(timeline: Timeline, second: float, where: str = COUNTER) -> FruitlessLooks | None:
    return fruitless_looks(timeline, where, "Mug", ns(second))


def test_by_hand_what_two_looks_leave() -> None:
    """0.3 x 0.2 / (0.3 x 0.2 + 0.7) = 0.06 / 0.76; and 0.012 / 0.712 after another."""
    timeline = missing((7, COUNTER, ()), (9, COUNTER, ()))
    found = told(timeline, 8)
    assert found is not None
    assert [p for _, p in found.posterior] == pytest.approx([0.3, 0.06 / 0.76, 0.012 / 0.712])
    assert (found.by_now, found.prior, found.p_detect) == (1, 0.3, 0.8)
    assert found.left == pytest.approx(0.06 / 0.76)
    after = told(timeline, 9)
    assert after is not None
    assert (after.by_now, after.left) == (2, pytest.approx(0.012 / 0.712))


def test_looks_count_until_the_item_is_seen() -> None:
    found = told(missing((7, COUNTER, ("Pot",)), (9, COUNTER, ("Mug",)), (11, COUNTER, ())), 15)
    assert found is not None
    assert found.by_now == 1


def test_looks_that_show_everything_leave_nothing_to_say() -> None:
    assert fruitless_looks(timeline_of(toy_run()), COUNTER, "Mug", ns(15)) is None
    assert told(missing((7, COUNTER, ("Mug",))), 15) is None
    assert told(missing((7, DESK, ())), 15) is None, "nobody looked there"
    assert fruitless_looks(missing((7, COUNTER, ())), COUNTER, "Spoon", ns(15)) is None, "nothing is believed of it"


def test_the_tab_says_what_is_left_from_the_look_on_and_draws_it() -> None:
    timeline = missing((7, COUNTER, ()))
    before, after = (
        str(
            container(
                container_history(timeline, INDEX[COUNTER], ns(s), focus="Mug"), Clock(timelines=(timeline,)), "Mug"
            )
        )
        for s in (6.0, 8.0)
    )
    assert "in vain:" not in before
    assert "1 look in vain: mug was believed here with 30" in after
    assert "left after looks in vain" in after
