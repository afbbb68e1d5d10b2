"""What is a plan? Typed steps with costs, and what its solver says of its quality."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from workbench.worlds.house import ItemId, ItemType, LocationId


class PlanStatus(StrEnum):
    SOLVED = "solved"
    NO_PLAN = "no-plan"
    """Proven: no sequence of actions meets the goal."""
    TIMED_OUT = "timed-out"
    SOLVER_FAILED = "solver-failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanStep:
    """One action.

    Attributes:
        action: move, pick, place, find, pour-water, make-coffee, pour-coffee, boil, peel, toast.
        origin: where the robot stands before it.
        target: where it stands after it (equal to origin for what is done on the spot).
        item_types: what it handles, as types, in the action's order.
        items: the instances, where they are known; empty for a find.
        cost: in cost units.
    """

    action: str
    origin: LocationId
    target: LocationId
    item_types: tuple[ItemType, ...] = ()
    items: tuple[ItemId, ...] = ()
    cost: float = 0.0

    def __str__(self) -> str:
        words = [self.action, *(self.items or self.item_types)]
        return " ".join(words) + (f" -> {self.target}" if self.target != self.origin else f" @ {self.origin}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Steps and what is known of their quality.

    Attributes:
        cost: sum of the steps' costs.
        lower_bound: no plan of this problem costs less; None when nothing is proven.
        optimal: cost equals the least possible.
        solver: which solver made it.
        note: why there is no plan, or what a pruning may lose.
    """

    status: PlanStatus
    steps: tuple[PlanStep, ...] = ()
    cost: float = 0.0
    lower_bound: float | None = None
    optimal: bool = False
    solver: str = ""
    note: str = ""
