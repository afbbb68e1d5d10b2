"""Scout-LIOS, a strategy that compares first steps for all missing items at once by rollouts.

It plans as its base strategy does, with find costs that count the whole search under the `marginal` belief. That
decision is compared with other first steps in worlds sampled from the belief (first_steps.py), and the step with
the least mean cost is taken. So several missing items are sought at once, containers near the route are looked into
while something is fetched or carried, and a known item far away does not end the search for a nearer one.

For goals with preparations it decides as its base strategy for cooking does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from workbench.planning.actions import prepares
from workbench.planning.composed import Composed, belief_types
from workbench.planning.plans import PlanStatus
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task
from workbench.worlds.house import ItemType

WORLDS, LOOKS = 100, 8
"""Number of sampled worlds, and most looks among the first steps; more of either did not improve costs
(docs/planning.md)."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Scout:
    """A strategy that compares the first step of a base strategy with alternatives.

    Attributes:
        base: the base strategy; its policy orders the looks.
        cooking: the strategy for goals with preparations.
        worlds: number of sampled worlds; 0 compares nothing.
        looks: most looks that are compared.
        pauses: replan after every pick and place while an item is missing, so that looks are also considered
            with an item in hand.
    """

    base: Composed
    cooking: Composed
    name: str = "scout-lios"
    worlds: int = WORLDS
    looks: int = LOOKS
    pauses: bool = True

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return belief_types(task)

    def decide(self, view: View) -> Decision:
        if prepares(view.task.goal):
            return self.cooking.decide(view)
        made = self.base.decide(view)
        if made.plan.status is not PlanStatus.SOLVED:
            return made
        searching = any(step.action == "find" for step in made.plan.steps)
        if self.worlds:
            made = self._best_by_rollouts(made, view)
        return _cut_after_manipulation(made) if self.pauses and searching else made

    def _best_by_rollouts(self, made: Decision, view: View) -> Decision:
        """The decision, or one with another first step whose mean cost over sampled worlds is lower."""
        from workbench.planning.rollouts import first_steps, situations

        delivery = None if isinstance(view.task.goal, Holding) else situations.delivery_of(view)
        own = None if delivery is None else first_steps.first_step_of(made, delivery)
        if delivery is None or own is None:
            return made
        seed = view.seed % 2**32, len(view.knowledge.visited), delivery.situation.robot
        best = first_steps.best_first_step(own, delivery, looks=self.looks, worlds=self.worlds, seed=seed)
        return made if best == own else first_steps.with_first_step(best, made, delivery, view)


def _cut_after_manipulation(made: Decision) -> Decision:
    """The decision, cut after its plan's first pick or place unless a find comes earlier."""
    steps = made.plan.steps
    end = next((i + 1 for i, step in enumerate(steps) if step.action in ("pick", "place", "find")), len(steps))
    if end == len(steps) or steps[end - 1].action == "find":
        return made
    return replace(made, steps_now=end)
