"""Which look is worth most for everything that is missing? Our strategy beyond one object at a time.

It plans as its base does, with find costs under the `marginal` belief that count the whole search, and goes past it:

- Several missing things are sought at once. While one is searched for, a look into a container is also worth
  something to the finds that come after it (look_worth.py). The order of the search is the one that costs least with
  that worth taken off each stop.
- Looks in passing. While the plan fetches or carries, a container that lies near the way is looked into when the look
  is worth more than the detour.
- Rollouts. What is decided so is tried against other first steps in worlds drawn from the belief (first_steps.py),
  and the one whose mean cost is least is taken.

For goals with preparation it decides as its base for cooking.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from workbench.planning.actions import prepares
from workbench.planning.composed import Composed, types_to_believe
from workbench.planning.look_worth import search_of, worth_of_looks
from workbench.planning.plans import PlanStatus, PlanStep
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task
from workbench.search.find_costs import SearchStop
from workbench.search.orders import along
from workbench.worlds.house import ContainerId, ItemType, LocationId

PASSES = 20
"""Passes of small changes to an order."""

WORLDS, LOOKS = 300, 16
"""Worlds in which first steps are tried, and how many looks are among them."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Scout:
    """Looks where it is worth most over a base strategy.

    Attributes:
        base: plans; its policy orders the looks.
        cooking: decides where things are to be prepared.
        share_in_passing: which share of a look's worth counts against a detour. The finds that it serves would pass
            by some of these containers anyway.
        margin: what a look in passing must save beyond its detour.
        worlds: in which other first steps are tried; 0 tries none.
        looks: how many looks are tried, at most.
        pauses: decides anew after every pick and every place while something is missing, so that looks are thought
            of with a thing in hand too.
    """

    base: Composed
    cooking: Composed
    name: str = "scout-lios"
    share_in_passing: float = 0.5
    margin: float = 3.0
    worlds: int = WORLDS
    looks: int = LOOKS
    pauses: bool = True

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return types_to_believe(task)

    def decide(self, view: View) -> Decision:
        if prepares(view.task.goal):
            return self.cooking.decide(view)
        made = self._by_worth(view)
        if made.plan.status is not PlanStatus.SOLVED:
            return made
        searching = any(step.action == "find" for step in made.plan.steps)
        if self.worlds:
            made = self._tried(made, view)
        return _up_to_next_choice(made) if self.pauses and searching else made

    def _by_worth(self, view: View) -> Decision:
        """The base's decision with its looks where they are worth most."""
        made = self.base.decide(view)
        finds = [step for step in made.plan.steps if step.action == "find"]
        if made.plan.status is not PlanStatus.SOLVED or not finds:
            return made
        if made.plan.steps[0] is not finds[0]:
            passing = self._in_passing(made, finds, view)
            return made if passing is None else replace(made, look_on_the_way=(passing,))
        if len(finds) == 1 or not made.search_order:
            return made
        return replace(made, search_order=self._for_all(finds, view))

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

    def _for_all(self, finds: list[PlanStep], view: View) -> tuple[SearchStop, ...]:
        """The first find's order, with what each look is worth to the other finds taken off its cost."""
        from workbench.search import tours

        worth = worth_of_looks(finds[1:], view, self.base.policy)
        search = search_of(finds[0], view, self.base.policy)
        here = search.here
        gain = np.array([worth[container] for container in here.containers])
        arrays = tours.Search(
            p=search.chance,
            model=tours.MODEL_NUMBERS["marginal"],
            from_m=here.from_m[0] - gain,
            between_m=np.ascontiguousarray(here.between_m - gain[None, :]),
            found=view.costs.manipulation + here.to_m[:, 0],
            look=float(view.costs.search),
        )
        order, _ = tours.improve(search.order, arrays, PASSES)
        return along(order, here, model="marginal", costs=view.costs).stops

    def _in_passing(self, made: Decision, finds: list[PlanStep], view: View) -> LocationId | None:
        """The container on the way to the plan's next place whose look saves most, if that is enough."""
        leg = next((step for step in made.plan.steps if step.action in ("move", "find")), None)
        if leg is None:
            return None
        onward = LocationId(made.search_order[0].container) if leg is finds[0] else leg.target
        worth = worth_of_looks(finds, view, self.base.policy)
        saved = {
            container: self.share_in_passing * value - view.costs.search - _detour(view, container, onward)
            for container, value in worth.items()
            if view.knowledge.travel.reaches(LocationId(container))
        }
        best = max(saved, key=lambda container: (saved[container], container), default=None)
        if best is None or saved[best] <= self.margin:
            return None
        return LocationId(best)


def _up_to_next_choice(made: Decision) -> Decision:
    """The decision with its plan's steps up to the first pick or place, unless a find comes before it."""
    steps = made.plan.steps
    end = next((i + 1 for i, step in enumerate(steps) if step.action in ("pick", "place", "find")), len(steps))
    if end == len(steps) or steps[end - 1].action == "find":
        return made
    note = "; ".join(filter(None, (made.plan.note, "the steps after these are decided anew")))
    return replace(made, plan=replace(made.plan, steps=steps[:end], note=note))


def _detour(view: View, container: ContainerId, onward: LocationId) -> float:
    """How much longer the way onward gets by way of a container, metres."""
    travel = view.knowledge.travel
    here, via, there = (travel.index(place) for place in (view.knowledge.robot_at, LocationId(container), onward))
    return float(travel.metres[here, via] + travel.metres[via, there] - travel.metres[here, there])
