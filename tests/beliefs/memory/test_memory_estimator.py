"""Beliefs with a memory: by hand, at the ends of time, and after looks that tell."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item, toy_house, toy_plan, toy_travel

from workbench.beliefs.asking.answered_estimator import answered
from workbench.beliefs.asking.state_questions import StateQuestions
from workbench.beliefs.belief import Belief
from workbench.beliefs.memory.memory import REARRANGED, Memory, NoEarlierRun, PastLook, remember
from workbench.beliefs.memory.memory_estimator import MemoryEstimator, rearranged, with_memory, without_memory
from workbench.beliefs.memory.move_rates import NS_PER_DAY, MoveRates
from workbench.errors import BadValue
from workbench.log_schema.memory_json import memory_from_settings, memory_to_settings
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG, BOOK = ItemType("Mug"), ItemType("Book")
RATES = MoveRates(others=0.2, by_type={BOOK: 0.01})


@dataclass(frozen=True)
class Flat:
    """The same chance everywhere."""

    chance: float = 0.2
    name: str = "flat@0"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        shape = (len(item_types), len(knowledge.unsearched))
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.full(shape, self.chance),
            estimator=self.name,
        )


def look(container: ContainerId, *types: ItemType, day: float = 0.0, run: str = "a", missed: float = 0.0) -> PastLook:
    return PastLook(
        container=container, seen_ns=round(day * NS_PER_DAY), item_types=tuple(sorted(types)), run=run, missed=missed
    )


def memory(*looks: PastLook, day: float, pace: float = 1.0) -> Memory:
    return Memory(at_ns=round(day * NS_PER_DAY), looks=looks, rates=RATES, pace=pace)


def start(**known: tuple[str, ...]) -> Knowledge:
    return knowledge_at_start(toy_plan(), toy_travel(), {})


def believed(held: Memory, item_type: ItemType, container: ContainerId, knowledge: Knowledge | None = None) -> float:
    belief = MemoryEstimator(base=Flat(), memory=held).believe(knowledge or start(), (item_type,))
    return float(belief.of(item_type)[belief.containers.index(container)])


def test_a_belief_is_the_mixture_that_its_docstring_says() -> None:
    held = memory(look(TABLE, MUG), look(DESK), day=2.0)
    stays = (1 - REARRANGED) * np.exp(-0.2 * 2.0)
    assert believed(held, MUG, TABLE) == pytest.approx(stays + (1 - stays) * 0.2, abs=1e-9)
    assert believed(held, MUG, DESK) == pytest.approx((1 - stays) * 0.2, abs=1e-9)
    assert believed(held, MUG, BED) == pytest.approx(0.2)


def test_memory_fades_with_time_and_with_how_often_such_things_move() -> None:
    days = (0.0, 1.0, 5.0, 400.0)
    mugs = [believed(memory(look(TABLE, MUG, BOOK), day=day), MUG, TABLE) for day in days]
    books = [believed(memory(look(TABLE, MUG, BOOK), day=day), BOOK, TABLE) for day in days]
    assert mugs == sorted(mugs, reverse=True)
    assert mugs[-1] == pytest.approx(0.2, abs=1e-6), "after a year, nothing is remembered of mugs"
    assert all(b >= m for b, m in zip(books, mugs, strict=True))
    assert believed(memory(look(TABLE, MUG), day=1.0, pace=5.0), MUG, TABLE) < mugs[1]


def test_what_was_found_gone_makes_the_rest_less_sure() -> None:
    held = memory(look(TABLE, MUG), look(COUNTER, BOOK), look(FRIDGE, MUG), day=0.5)
    gone = start().seen(FRIDGE, ())
    there = start().seen(FRIDGE, (item("Mug|9"),))
    assert rearranged(held, there) < rearranged(held, start()) < rearranged(held, gone)
    assert believed(held, MUG, TABLE, gone) < believed(held, MUG, TABLE) < believed(held, MUG, TABLE, there)


def test_an_empty_look_that_can_miss_leaves_a_chance() -> None:
    sure, unsure = (memory(look(DESK, missed=m), day=0.0) for m in (0.0, 0.5))
    posterior = 0.2 * 0.5 / (0.8 + 0.2 * 0.5)
    assert believed(unsure, MUG, DESK) == pytest.approx((1 - REARRANGED) * posterior + REARRANGED * 0.2, abs=1e-9)
    assert believed(sure, MUG, DESK) == pytest.approx(REARRANGED * 0.2, abs=1e-9)


def test_searched_containers_are_not_believed_in_and_no_memory_changes_nothing() -> None:
    knowledge = start().seen(TABLE, ())
    belief = MemoryEstimator(base=Flat(), memory=memory(look(TABLE, MUG), day=1.0)).believe(knowledge, (MUG, BOOK))
    assert TABLE not in belief.containers
    base = Flat()
    assert with_memory(base, None) is base


def test_a_log_that_does_not_say_its_prior_is_of_the_earlier_one() -> None:
    """Its beliefs and its digest, by which the log names the estimator, are those that it was recorded with."""
    held = memory(look(TABLE, MUG), day=1.0)
    stored = memory_to_settings(held)
    assert memory_from_settings(stored) == held
    del stored["memory"]["rearranged"]
    earlier = memory_from_settings(stored)
    assert earlier is not None
    assert earlier == replace(held, rearranged=0.5)
    assert believed(earlier, MUG, TABLE) > believed(held, MUG, TABLE)
    assert earlier.digest == "f91e6df1" != held.digest
    with pytest.raises(BadValue, match="everything was moved"):
        replace(held, rearranged=1.0)


def test_names_tell_memories_apart() -> None:
    one, other = (MemoryEstimator(base=Flat(), memory=memory(look(TABLE, MUG), day=day)) for day in (1.0, 2.0))
    assert one.name != other.name
    assert without_memory(one.name) == "flat@0"


def test_of_each_container_the_last_look_before_the_run_counts() -> None:
    looks = (look(TABLE, MUG, day=1), look(TABLE, day=2, run="b"), look(TABLE, BOOK, day=9, run="c"))
    held = remember(looks, at_ns=3 * NS_PER_DAY, rates=RATES)
    assert [x.run for x in held.looks] == ["b"]
    assert held.runs == ("a", "b")
    assert held.pace > 1.0, "the mug was gone after a day"
    with pytest.raises(NoEarlierRun):
        remember(looks, at_ns=0, rates=RATES)


def test_bad_memories_are_refused() -> None:
    with pytest.raises(BadValue):
        memory(look(TABLE, day=3), day=1.0)
    with pytest.raises(BadValue):
        memory(look(TABLE), look(TABLE, day=0.5), day=1.0)
    with pytest.raises(BadValue):
        memory(look(TABLE), day=1.0, pace=0.0)
    with pytest.raises(BadValue):
        replace(look(TABLE), missed=1.0)
    assert toy_house().contents


def test_what_is_gone_from_its_place_may_be_anywhere() -> None:
    held = memory(look(TABLE, MUG), look(DESK), day=0.5)
    assert believed(held, MUG, DESK) < 0.15
    assert believed(held, MUG, DESK, start().seen(TABLE, ())) == pytest.approx(0.2)


def test_an_estimator_that_asks_has_no_memory() -> None:
    asks = answered(StateQuestions("asks", None, names_alone=False), may_ask=False)
    with pytest.raises(BadValue, match="an estimator that asks no questions"):
        with_memory(asks, memory(look(DESK, MUG), day=1.0))
    assert with_memory(asks, None) is asks
