"""What would a strategy have cost, at least and at most, over every world that agrees with the log?

What the answer says, and what it rests on. How it is found: settling.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf

from replayers.unfolding import Leaf, Told

NEAR = 1e-6
"""Costs closer than this are one: the log rounds to six decimals."""

MOST_TOLD = 2000
"""Groups of worlds, for comparisons world by world; beyond this, the bounds alone are kept."""


class Proof(StrEnum):
    """What a bound rests on."""

    EXACT = "exact"
    """Some world that agrees with the log has exactly this cost, and none goes beyond it."""
    OUTER = "outer"
    """No world goes beyond it; whether one comes up to it is not known."""
    STRAIGHT = "outer-if-straight"
    """As outer, for strategies that go straight (most_to_walk.py)."""
    NONE = "none"
    """No upper bound is known: the strategy does not go straight, or things are to be prepared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """The least and the largest cost over all worlds that agree with the log.

    Attributes:
        lower, upper: charged costs; upper is infinite where no upper bound is known.
        lower_proof, upper_proof: what each rests on.
        least_found, largest_found: costs that some world certainly has.
        complete: every world was followed to its end.
        stretches: how many stretches of the loop it took.
        can_fail: some world makes the strategy fail, as far as it was followed.
        cheapest, dearest: ends that cost least_found and largest_found: worlds that one can look at.
        told: what is known of the cost in each group of worlds, all of them together; empty when there are too many.
    """

    lower: float
    upper: float
    lower_proof: Proof
    upper_proof: Proof
    least_found: float
    largest_found: float
    complete: bool
    stretches: int
    can_fail: bool
    cheapest: Leaf | None = None
    dearest: Leaf | None = None
    told: tuple[Told, ...] = ()

    @property
    def exact(self) -> bool:
        """Every world gives the same cost."""
        return self.upper - self.lower <= NEAR

    @property
    def width(self) -> float:
        """(upper - lower) / lower; 0 when exact."""
        return 0.0 if self.exact else (self.upper - self.lower) / self.lower if self.lower > 0 else inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """How much work one strategy over one log may take.

    Attributes:
        stretches: stretches of the loop, each about one decision.
        finish: where fewer than this were needed, every world is followed to its end even though the bounds are
            settled: comparisons world by world need all ends.
        draws: stretches for the estimate; beyond, fewer worlds are drawn (estimates.py).
    """

    stretches: int = 400
    finish: int = 150
    draws: int = 100
