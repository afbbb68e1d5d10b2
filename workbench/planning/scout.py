"""Which first step is best for everything that is missing? Our strategy beyond one object at a time.

It plans as its base does, with find costs under the `marginal` belief that count the whole search. What is decided so
is tried against other first steps in worlds drawn from the belief (first_steps.py), and the one whose mean cost is
least is taken. So several missing things are sought at once, a container near the way is looked into while something
is fetched or carried, and a thing that is known far away does not end the search for a nearer one.

For goals with preparation it decides as its base for cooking.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from workbench.planning.actions import prepares
from workbench.planning.composed import Composed, types_to_believe
from workbench.planning.plans import PlanStatus
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task
from workbench.worlds.house import ItemType

WORLDS, LOOKS = 100, 8
"""Worlds in which first steps are tried, and how many looks are among them; more of either gained nothing
(docs/planning.md)."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Scout:
    """Tries other first steps than those of a base strategy.

    Attributes:
        base: plans; its policy orders the looks.
        cooking: decides where things are to be prepared.
        worlds: in which other first steps are tried; 0 tries none.
        looks: how many looks are tried, at most.
        pauses: decides anew after every pick and every place while something is missing, so that looks are thought
            of with a thing in hand too.
    """

    base: Composed
    cooking: Composed
    name: str = "scout-lios"
    worlds: int = WORLDS
    looks: int = LOOKS
    pauses: bool = True

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return types_to_believe(task)

    def decide(self, view: View) -> Decision:
        if prepares(view.task.goal):
            return self.cooking.decide(view)
        made = self.base.decide(view)
        if made.plan.status is not PlanStatus.SOLVED:
            return made
        searching = any(step.action == "find" for step in made.plan.steps)
        if self.worlds:
            made = self._tried(made, view)
        return _up_to_next_choice(made) if self.pauses and searching else made

    def _tried(self, made: Decision, view: View) -> Decision:
        """The decision, or the same with another first step that costs less in worlds drawn from the belief."""
        from workbench.planning import first_steps, situations

        delivery = None if isinstance(view.task.goal, Holding) else situations.delivery_of(view)
        own = None if delivery is None else first_steps.first_step_of(made, delivery)
        if delivery is None or own is None:
            return made
        steps = (own, *first_steps.other_first_steps(own, delivery, looks=self.looks))
        if len(steps) == 1:
            return made
        rng = np.random.default_rng((view.seed % 2**32, len(view.knowledge.visited), delivery.situation.robot))
        best = first_steps.cheapest(steps, delivery, worlds=self.worlds, rng=rng)
        return made if best == own else first_steps.beginning_with(best, made, delivery, view)


def _up_to_next_choice(made: Decision) -> Decision:
    """The decision, to be made anew after its plan's first pick or place, unless a find comes before that."""
    steps = made.plan.steps
    end = next((i + 1 for i, step in enumerate(steps) if step.action in ("pick", "place", "find")), len(steps))
    if end == len(steps) or steps[end - 1].action == "find":
        return made
    return replace(made, steps_now=end)
