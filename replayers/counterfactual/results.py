"""Bounds and estimates of a cost as plain values, stored as they are."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum
from math import inf

from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ContainerId, ItemType


class Proof(StrEnum):
    """What a bound rests on."""

    EXACT = "exact"
    """Attained: some consistent world has exactly this cost, and no consistent world exceeds it."""
    OUTER = "outer"
    """No consistent world exceeds it; whether one attains it is not known."""
    STRAIGHT = "outer-if-straight"
    """As outer, but only for strategies that go straight (docs/replay.md, Bounds)."""
    NONE = "none"
    """No upper bound is known: the strategy does not go straight, or things are to be prepared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundFigures:
    """The least and the largest cost over all worlds that agree with the log.

    Attributes:
        lower, upper: charged costs; upper is infinite where no upper bound is known.
        lower_proof, upper_proof: what each rests on.
        least_found, largest_found: costs that some world certainly has, the least and the largest that is known;
            drawn worlds count (Bounds.with_ends). Not finite where no run was followed to its end.
        complete: every world was followed to its end.
        can_fail: some world makes the strategy fail, as far as it was followed.
    """

    lower: float
    upper: float
    lower_proof: Proof
    upper_proof: Proof
    least_found: float
    largest_found: float
    complete: bool
    can_fail: bool

    def as_row(self) -> dict[str, float | str | bool | None]:
        """The figures by name; None where one is not finite."""
        values = {f.name: getattr(self, f.name) for f in fields(BoundFigures)}
        return {name: None if value in (inf, -inf) else value for name, value in values.items()}

    @property
    def exact(self) -> bool:
        """Every world gives the same cost."""
        return self.upper - self.lower <= NEAR_COST

    @property
    def width(self) -> float:
        """(upper - lower) / lower; 0 when exact."""
        return 0.0 if self.exact else (self.upper - self.lower) / self.lower if self.lower > 0 else inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A mean over sampled worlds.

    Attributes:
        mean: mean charged cost, in metres and their equivalents.
        ci95: 95 % Monte Carlo confidence interval of that mean: more worlds make it narrower.
        interval90: the shortest interval that contains the cost in at least 90 % of the sampled worlds, ends
            included.
        interval90_mass: the share of sampled worlds that it contains: more than 90 % where costs are discrete.
        success: share of worlds in which the task was done.
        worlds: how many were sampled.
    """

    mean: float
    ci95: tuple[float, float]
    interval90: tuple[float, float]
    interval90_mass: float
    success: float
    worlds: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """What an open container answered, and for which types it was asked: the others no longer mattered."""

    container: ContainerId
    live: tuple[ItemType, ...]
    answer: tuple[ItemType, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldGroup:
    """Bounds of the charged cost in all worlds that answer as `filled` says; both equal at the end of a run.

    most is infinite where no bound is known.
    """

    filled: tuple[Assignment, ...]
    least: float
    most: float
