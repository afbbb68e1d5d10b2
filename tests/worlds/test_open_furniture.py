"""Which containers need no opening: every type has a row with a reason, and unknown ones count as closed."""

from __future__ import annotations

from dataclasses import replace

from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_plan

from workbench.worlds.names import container_types
from workbench.worlds.sight.open_furniture import needs_no_opening, open_furniture


def test_every_container_type_has_a_row_with_a_reason() -> None:
    assert tuple(sorted(open_furniture())) == container_types()
    assert all(row.reason for row in open_furniture().values())


def test_tables_are_open_and_fridges_are_not() -> None:
    plan = toy_plan()
    assert {c.id for c in plan.containers if needs_no_opening(c)} == {COUNTER, TABLE, BED, DESK}
    assert not needs_no_opening(plan.container(FRIDGE))


def test_a_type_that_is_not_in_the_table_is_closed() -> None:
    assert not needs_no_opening(replace(toy_plan().container(TABLE), type="Wardrobe"))
    assert needs_no_opening(replace(toy_plan().container(TABLE), type="ObjaDiningTable"))
