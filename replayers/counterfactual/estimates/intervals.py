"""Interval of the cost from a node of the run tree on: outer bounds, and the costs that were attained."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite


@dataclass(slots=True)
class CostInterval:
    """Bounds of the cost from a node on.

    Attributes:
        low, high: bounds over the worlds in which the task is done; (inf, -inf) when there is none.
        may_fail: some world may fail.
        found_low, found_high, fails: the same, over run ends that were reached.
        whole: every run end below is known.
        spent: nothing below can be explored any further, whole or not.
    """

    low: float
    high: float
    may_fail: bool
    found_low: float = inf
    found_high: float = -inf
    fails: bool = False
    whole: bool = False
    spent: bool = False

    def lower(self, cost: float, failure: float) -> float:
        return min(cost + self.low, failure if self.may_fail else inf)

    def upper(self, cost: float, failure: float) -> float:
        return max(cost + self.high, failure if self.may_fail else -inf)

    def least_found(self, cost: float, failure: float) -> float:
        return min(cost + self.found_low, failure if self.fails else inf)

    def largest_found(self, cost: float, failure: float) -> float:
        return max(cost + self.found_high, failure if self.fails else -inf)

    @classmethod
    def at_end(cls, cost: float, *, done: bool) -> CostInterval:
        """The interval of a run that has ended."""
        if done:
            return cls(cost, cost, may_fail=False, found_low=cost, found_high=cost, whole=True, spent=True)
        return cls(inf, -inf, may_fail=True, fails=True, whole=True, spent=True)

    @classmethod
    def over(cls, below: list[CostInterval], cost: float) -> CostInterval:
        """The interval of a node from those of its children; cost is that of the way to them."""
        return cls(
            low=cost + min(b.low for b in below),
            high=cost + max(b.high for b in below),
            may_fail=any(b.may_fail for b in below),
            found_low=cost + min(b.found_low for b in below),
            found_high=cost + max(b.found_high for b in below),
            fails=any(b.fails for b in below),
            whole=all(b.whole for b in below),
            spent=all(b.spent for b in below),
        )


def finite(cost: float) -> float | None:
    """The cost; None where it is infinite: there is no bound, or nothing was found. JSON has no infinity."""
    return cost if isfinite(cost) else None
