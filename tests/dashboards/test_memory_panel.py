"""The panel of a place's memory: what it tells of days, by hand, and what it bounds and escapes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from toy import DESK, TABLE, toy_plan

from dashboards.panels.memory import MAX_DAYS, MAX_ITEMS, DayOfItem, days_of_items, memory
from dashboards.viser_app.serving import open_dashboard
from replayers.memory.collect import read_history
from workbench.beliefs.memory.history import EarlierRun, History, SeveralPlaces
from workbench.beliefs.memory.memory import PastLook
from workbench.beliefs.memory.move_rates import NS_PER_DAY
from workbench.worlds.house import ContainerId, ItemType

SHIPPED = Path(__file__).parents[2] / "logs"


def look(container: ContainerId, *types: str, day: float) -> PastLook:
    return PastLook(
        container=container,
        seen_ns=round(day * NS_PER_DAY),
        item_types=tuple(ItemType(t) for t in sorted(types)),
        run=f"run {day}",
    )


def history(*looks: PastLook) -> History:
    runs = tuple(EarlierRun(id=x.run, log=x.run, started_ns=x.seen_ns, ended_ns=x.seen_ns) for x in looks)
    return History(plan=toy_plan(), runs=runs, looks=looks)


def test_each_day_tells_where_a_thing_was_and_where_it_was_gone() -> None:
    found = days_of_items(
        history(look(TABLE, "Mug", "Book", day=1), look(TABLE, "Book", day=3), look(DESK, "Mug", day=3.5))
    )
    assert found == {
        "Book": {1: DayOfItem(seen=(TABLE,)), 3: DayOfItem(seen=(TABLE,))},
        "Mug": {1: DayOfItem(seen=(TABLE,)), 3: DayOfItem(seen=(DESK,), gone=(TABLE,))},
    }


def test_many_days_and_items_are_cut_and_names_are_escaped() -> None:
    days = [look(TABLE, "<script>", *(f"Thing{k}" for k in range(MAX_ITEMS + 5)), day=d) for d in range(MAX_DAYS + 3)]
    shown = str(memory(history(*days)))
    assert "<script>" not in shown
    assert "3 earlier days and 6 more kinds of items" in shown
    strange = replace(look(TABLE, "Mug", day=0), seen_ns=2**62)
    assert "<th" in str(memory(history(strange)))


def test_the_shipped_runs_of_one_house_have_a_memory_and_those_of_two_have_none() -> None:
    one = [SHIPPED / "find-lios.mcap", SHIPPED / "find-greedy.mcap"]
    shown = str(memory(read_history(one)))
    assert "2 runs in" in shown
    with pytest.raises(SeveralPlaces):
        open_dashboard([one[0], SHIPPED / "deliver-3.mcap"], port=0, memory=True)
