"""Least and greatest cost of a strategy over every world that is consistent with the log, and what each bound rests
on.

These are the result types only; the branch-and-bound search that computes them is a module of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf

from replayers.unfolding import Leaf, Told

NEAR = 1e-6
"""Costs closer than this are equal: the log rounds to six decimals."""

MOST_TOLD = 2000
"""Groups of worlds, for comparisons world by world; beyond this, the bounds alone are kept."""


class Proof(StrEnum):
    """What a bound rests on."""

    EXACT = "exact"
    """Attained: some consistent world has exactly this cost, and no consistent world exceeds it."""
    OUTER = "outer"
    """No consistent world exceeds it; whether one attains it is not known."""
    STRAIGHT = "outer-if-straight"
    """As outer, but only for strategies that go straight (docs/replay.md, Bounds)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """The least and the greatest cost over all worlds that are consistent with the log.

    Attributes:
        lower, upper: charged costs, in metres and their equivalents.
        lower_proof, upper_proof: what each rests on.
        least_found, largest_found: the extreme costs that were attained in some consistent world.
        complete: every world was followed to its end.
        stretches: how many segments of the closed loop were run.
        can_fail: some world makes the strategy fail, as far as it was followed.
        cheapest, dearest: run ends that cost least_found and largest_found, each with the world it happened in.
        told: bounds of the cost in each group of worlds; the groups cover all worlds. Empty when there are too many.
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
    """How much work may be spent on one strategy over one log.

    Attributes:
        stretches: segments of the closed loop, each about one decision.
        finish: where fewer than this were needed, every world is followed to its end even though the bounds are
            settled: comparisons world by world need all ends.
        draws: segments for the estimate; when they are spent, fewer worlds are drawn.
    """

    stretches: int = 400
    finish: int = 150
    draws: int = 100
