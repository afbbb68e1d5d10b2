"""What does a planner see, and what does it answer? The seam that strategies fill.

A strategy receives a frozen view and never the truth. It answers one decision: a plan, and for the plan's first
find the order in which to look. The loop walks the plan until something is learnt, then asks again.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """All that planning may see.

    Attributes:
        knowledge: the robot's state as it knows it.
        belief: over the unsearched containers, for the task's relevant item types.
        task: what to do.
        costs: action costs.
        budget_s: planning seconds that are left.
        seed: for strategies that draw; the same view gives the same decision.
    """

    knowledge: Knowledge
    belief: Belief
    task: Task
    costs: ActionCosts
    budget_s: float
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """A way not taken: what the plan would have begun with instead, and what it would have cost."""

    title: str
    cost: float
    why_not: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A plan and where its first find looks first.

    Attributes:
        plan: steps from here to the goal.
        find_costs: the table that the plan was made with, if it has finds.
        search_order: for the plan's first find, the policy's order; its first stop is walked.
        alternatives: ways not taken, cheapest first.
        look_on_the_way: containers to look into while standing at or passing them before the first step
            (opportunistic search); usually empty.
        steps_now: how many of the plan's steps are walked before it decides anew; None for as far as the plan goes.

    Raises:
        BadValue: steps_now below 1; the run would decide for ever and do nothing.
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
    """Find cost + search policy + belief model + solver."""

    @property
    def name(self) -> str:
        """In lower case with hyphens: "model-lios"."""
        ...

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        """The item types about which it wants beliefs, sorted: the goal's, and what preparing them needs."""
        ...

    def decide(self, view: View) -> Decision: ...


StrategyFactory = Callable[[House | None], Strategy]
"""Makes a strategy. Only the oracle looks at the house; everything else must ignore it and work with None."""
