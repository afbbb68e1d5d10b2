"""The strategy protocol: the view that a planner gets and the decision that it returns.

A strategy receives a frozen view and never the true house. It returns one decision: a plan, and for the plan's
first find the order in which to search. The execution loop carries out the plan until it learns something new, then
asks again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.planning.plans import Plan
from workbench.planning.tasks import Task
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.worlds.house import House, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import PERFECT, Perception


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Everything that a strategy may use for a decision.

    Attributes:
        knowledge: the robot's state and what it has observed.
        belief: over the unsearched containers, for the task's relevant item types.
        task: the task.
        costs: action costs.
        budget_s: planning time that is left, in seconds.
        seed: for strategies that sample; the same view gives the same decision.
        perception: how surely a look shows what is there.
    """

    knowledge: Knowledge
    belief: Belief
    task: Task
    costs: ActionCosts
    budget_s: float
    seed: int = 0
    perception: Perception = PERFECT


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """An alternative that was not taken: how the plan would have begun, and what it would have cost."""

    title: str
    cost: float
    why_not: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A plan, and the search order of its first find.

    Attributes:
        plan: the steps from the current state to the goal.
        find_costs: the find costs used by the plan, if it has finds.
        search_order: the policy's order for the plan's first find; the robot goes to its first stop.
        alternatives: alternatives not taken, cheapest first.
        look_on_the_way: containers to look into at or near the robot's route before the first step
            (opportunistic search); usually empty.
        steps_now: number of steps to execute before replanning; None for the whole plan.

    Raises:
        BadValue: steps_now is below 1; the run would never advance.
    """

    plan: Plan
    find_costs: FindCosts | None = None
    search_order: tuple[SearchStop, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    look_on_the_way: tuple[LocationId, ...] = ()
    steps_now: int | None = None

    def __post_init__(self) -> None:
        if self.steps_now is not None and self.steps_now < 1:
            raise BadValue("steps_now", self.steps_now, "at least 1")


class Strategy(Protocol):
    """A planner: decides from a view what the robot does next."""

    @property
    def name(self) -> str:
        """The name in lower case with hyphens, such as "model-lios"."""
        ...

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        """The item types that it needs beliefs about, sorted: those of the goal and of its preparations."""
        ...

    def decide(self, view: View) -> Decision: ...


StrategyFactory = Callable[[House | None], Strategy]
"""Makes a strategy. Only the oracle uses the house; all others must ignore it and accept None."""
