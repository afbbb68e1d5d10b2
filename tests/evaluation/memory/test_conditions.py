"""The table of the memory experiment, by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from workbench.evaluation.memory.conditions import MemoryCost, memory_rows


def cost(house: str, without: float, remembered: float, oracle: float, *, known: bool = True) -> MemoryCost:
    return MemoryCost(
        condition="c",
        strategy="s",
        house=house,
        known=known,
        without=without,
        remembered=remembered,
        oracle=oracle,
        up_to_date=(remembered + oracle) / 2,
    )


def test_shares_are_of_sums_and_paired() -> None:
    (row,) = memory_rows([cost("a", 10, 6, 4), cost("b", 30, 24, 20, known=False)], seed=0)
    assert row["saved"] == pytest.approx(10 / 40)
    assert row["oracle_saves"] == pytest.approx(16 / 40)
    assert row["up_to_date_saves"] == pytest.approx(13 / 40), "5 and 22 of 40"
    assert row["gap_closed"] == pytest.approx(10 / 16)
    assert row["sought_was_seen"] == 0.5
    assert (row["trials"], row["houses"]) == (2, 2)
    low, high = row["saved_ci95"]
    assert low <= row["saved"] <= high


def test_rows_are_of_one_strategy_and_condition_each() -> None:
    other = replace(cost("a", 2, 3, 1), condition="d")
    rows = memory_rows([cost("a", 10, 6, 4), other, cost("b", 10, 6, 4)], seed=0)
    assert [(row["condition"], row["trials"]) for row in rows] == [("c", 2), ("d", 1)]
    assert rows[1]["saved"] == pytest.approx(-0.5)
