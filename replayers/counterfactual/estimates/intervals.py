"""Interval of the cost from a node of the run tree on: outer bounds, and the costs that were attained."""

from __future__ import annotations

from collections.abc import Sequence
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

    def narrow_to(self, other: CostInterval, *, behind: float = 0.0) -> None:
        """Leaves of the outer bounds what agrees with others that hold as well; costs that were attained stay inside.

        Args:
            other: of this node, or of one before it.
            behind: the cost of the way from there.
        """
        self.low = max(self.low, min(other.low - behind, self.found_low))
        self.high = min(self.high, max(other.high - behind, self.found_high))
        self.may_fail = self.fails or (self.may_fail and other.may_fail)

    def narrowed_to(self, other: CostInterval, *, behind: float = 0.0) -> CostInterval:
        """A copy, narrowed."""
        found, failing = (self.found_low, self.found_high), (self.fails, self.whole, self.spent)
        made = CostInterval(self.low, self.high, self.may_fail, *found, *failing)
        made.narrow_to(other, behind=behind)
        return made

    @classmethod
    def at_end(cls, cost: float, *, done: bool) -> CostInterval:
        """The interval of a run that has ended."""
        if done:
            return cls(cost, cost, may_fail=False, found_low=cost, found_high=cost, whole=True, spent=True)
        return cls(inf, -inf, may_fail=True, fails=True, whole=True, spent=True)

    @classmethod
    def over(cls, below: Sequence[tuple[float, CostInterval]]) -> CostInterval:
        """The interval of a node from those of its children, each with the cost of the way to it."""
        low, high, found_low, found_high = inf, -inf, inf, -inf
        may_fail, fails, whole, spent = False, False, True, True
        for behind, child in below:  # min and max would take half as long again
            if behind + child.low < low:
                low = behind + child.low
            if behind + child.high > high:
                high = behind + child.high
            if behind + child.found_low < found_low:
                found_low = behind + child.found_low
            if behind + child.found_high > found_high:
                found_high = behind + child.found_high
            may_fail, fails = may_fail or child.may_fail, fails or child.fails
            whole, spent = whole and child.whole, spent and child.spent
        return cls(low, high, may_fail, found_low, found_high, fails, whole, spent)


def finite(cost: float) -> float | None:
    """The cost; None where it is infinite: there is no bound, or nothing was found. JSON has no infinity."""
    return cost if isfinite(cost) else None
