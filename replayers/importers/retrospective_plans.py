"""Beliefs and plans computed after the fact for a bag, which records what the robot did but not why; marked as such.

After each observation, an estimator and a strategy state what they would have believed and planned; their events
carry AFTER_THE_FACT as the reason, and the log's settings list them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from recorders.spot.session.inferred_actions import ActionDeriver
from workbench.beliefs.belief import Estimator
from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    Event,
    FindCostsUpdated,
    PlanMade,
    RunEnded,
)
from workbench.planning.strategy import Strategy, View
from workbench.planning.tasks import AllOf, Task
from workbench.search.costs import ActionCosts

AFTER_THE_FACT = "computed after the fact"


@dataclass(slots=True, kw_only=True)
class RetrospectivePlanner:
    """Sits between the derivation of events and a recorder; adds beliefs, find costs and plans, and numbers
    decisions."""

    strategy: Strategy | None
    estimator: Estimator | None
    task: Task
    costs: ActionCosts
    tell: Callable[[Event], None]
    decision: int = 0

    def begin(self, derived: ActionDeriver, stamp_ns: int) -> None:
        """Adds the decision before anything is done."""
        self._think(derived, stamp_ns)

    def take(self, derived: ActionDeriver, event: Event) -> None:
        """Passes an event on; after an observation, adds what would have been planned then."""
        if isinstance(event, ActionEnded | ContainerObserved | RunEnded):
            event = replace(event, decision=self.decision)
        self.tell(event)
        if isinstance(event, ContainerObserved):
            self._think(derived, event.stamp_ns)

    def _think(self, derived: ActionDeriver, stamp_ns: int) -> None:
        if self.strategy is None or self.estimator is None or self.task.goal == AllOf(parts=()):
            return
        knowledge = derived.knowledge
        belief = self.estimator.believe(knowledge, self.strategy.relevant_types(self.task))
        made = self.strategy.decide(
            View(knowledge=knowledge, belief=belief, task=self.task, costs=self.costs, budget_s=self.task.budget_s)
        )
        self.decision += 1
        self.tell(BeliefUpdated(stamp_ns=stamp_ns, decision=self.decision, belief=belief))
        if made.find_costs is not None:
            self.tell(FindCostsUpdated(stamp_ns=stamp_ns, decision=self.decision, find_costs=made.find_costs))
        self.tell(
            PlanMade(
                stamp_ns=stamp_ns,
                decision=self.decision,
                robot_at=knowledge.robot_at,
                reason=AFTER_THE_FACT,
                made=made,
                belief_s=0.0,
                planning_s=0.0,
            )
        )
