"""Plans: typed steps with costs, and the quality that the solver guarantees."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from workbench.worlds.house import ItemId, ItemType, LocationId


class PlanStatus(StrEnum):
    """How planning ended."""

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
        origin: the robot's location before the step.
        target: the robot's location after the step (equal to origin for manipulations).
        item_types: types of the items handled, in the order of the action's parts.
        items: ids of the items handled, where known; empty for a find.
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
    """The steps of a plan and its guarantees.

    Attributes:
        cost: sum of the steps' costs.
        lower_bound: proven lower bound on the cost of any plan of this problem; None without one.
        optimal: whether the cost is proven optimal.
        solver: name of the solver.
        note: why there is no plan, or what a pruning may have lost.
    """

    status: PlanStatus
    steps: tuple[PlanStep, ...] = ()
    cost: float = 0.0
    lower_bound: float | None = None
    optimal: bool = False
    solver: str = ""
    note: str = ""
