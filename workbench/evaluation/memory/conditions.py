"""The conditions of the memory experiment, and its table: the cost saved by remembering, paired, with intervals.

In each condition five earlier runs were made in a house on one day; since then a share of its items has moved, and
some days have passed. The robot knows the days and the rates of moving, but not the share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.beliefs.memory.move_rates import NS_PER_DAY
from workbench.evaluation.statistics import mean_with_interval, ratio_with_interval

EARLIER_RUNS = 5
HOUR_NS = NS_PER_DAY // 24


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryCondition:
    """What has happened since the earlier runs.

    Attributes:
        moved: share of the items that stand elsewhere.
        days: between the first earlier run and the run that remembers.
    """

    name: str
    moved: float
    days: float


CONDITIONS: tuple[MemoryCondition, ...] = (
    MemoryCondition(name="nothing moved", moved=0.0, days=1.0),
    MemoryCondition(name="one in four moved", moved=0.25, days=1.0),
    MemoryCondition(name="all moved, in two months", moved=1.0, days=60.0),
    MemoryCondition(name="all moved, in one day", moved=1.0, days=1.0),
)
"""In one day the shipped rates expect one item in five to move: in the last condition they are wrong, as when a house
is cleared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryCost:
    """One query or task, run three times.

    Attributes:
        known: whether what is sought had been seen in an earlier run.
        without, remembered, oracle: the cost without memory, with it, and knowing the house.
        up_to_date: the cost where it is known what the containers that earlier runs opened hold now.
    """

    condition: str
    strategy: str
    house: str
    known: bool
    without: float
    remembered: float
    oracle: float
    up_to_date: float


def memory_rows(costs: Sequence[MemoryCost], *, seed: int) -> list[dict[str, Any]]:
    """One row for each strategy and condition.

    Args:
        seed: of the bootstrap over houses; every row draws the same ones.
    """
    kinds = dict.fromkeys((c.strategy, c.condition) for c in costs)
    found = {kind: [c for c in costs if (c.strategy, c.condition) == kind] for kind in kinds}
    return [_row(strategy, condition, found[strategy, condition], seed) for strategy, condition in kinds]


def _row(strategy: str, condition: str, costs: Sequence[MemoryCost], seed: int) -> dict[str, Any]:
    without, remembered, oracle, up_to_date = (
        np.array([getattr(c, name) for c in costs]) for name in ("without", "remembered", "oracle", "up_to_date")
    )
    houses = [c.house for c in costs]

    def share(part: Any, whole: Any) -> tuple[float, tuple[float, float]]:
        found = ratio_with_interval(part, whole, houses, rng=np.random.default_rng(seed))
        return found.value, found.interval

    saved, saved_ci = share(without - remembered, without)
    most, most_ci = share(without - oracle, without)
    current, current_ci = share(without - up_to_date, without)
    gap, gap_ci = share(without - remembered, without - oracle)
    cost = mean_with_interval(remembered, houses, rng=np.random.default_rng(seed))
    return {
        "strategy": strategy,
        "condition": condition,
        "trials": len(costs),
        "houses": len(set(houses)),
        "sought_was_seen": float(np.mean([c.known for c in costs])),
        "cost_without": float(without.mean()),
        "cost_remembered": cost.value,
        "cost_oracle": float(oracle.mean()),
        "cost_up_to_date": float(up_to_date.mean()),
        "saved": saved,
        "saved_ci95": saved_ci,
        "oracle_saves": most,
        "oracle_saves_ci95": most_ci,
        "up_to_date_saves": current,
        "up_to_date_saves_ci95": current_ci,
        "gap_closed": gap,
        "gap_closed_ci95": gap_ci,
        "ci95_resamples": cost.resampled(),
    }
