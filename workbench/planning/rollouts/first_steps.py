"""Comparison of alternative first steps by rollouts in worlds sampled from the belief.

Candidates are the decision's own first step, the most promising looks (for one missing item, for all of them, and
relative to the detour from the planned route), and fetching each known item. The policy of kernels.py continues
each of them; the comparison itself is compiled (choice.py).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from workbench.arrays import Floats
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.rollouts import choice
from workbench.planning.rollouts.situations import Delivery
from workbench.planning.strategy import Decision, View
from workbench.worlds.house import ContainerId, Item, LocationId

SOLVER = "rollouts"
FETCH, LOOK = 0, 1
"""Kinds of first steps: fetch (or go on carrying) a wanted item and deliver it; look into a container."""
DRAWN_SIZE = 64
"""Number of cached draws, about 0.1 MB each."""


@dataclass(frozen=True, slots=True)
class FirstStep:
    """FETCH a want, or LOOK into a container, by index in the delivery.

    Attributes:
        leads_to: the location index to which it leads first, where that is known; not compared.
    """

    kind: int
    target: int
    leads_to: int = field(default=-1, compare=False)

    def move(self, delivery: Delivery) -> int:
        """As a move of the rollouts (delivery_state.Scratch)."""
        return self.target if self.kind == LOOK else len(delivery.containers) + self.target


def first_step_of(made: Decision, delivery: Delivery) -> FirstStep | None:
    """The first step of a decision; None for steps that rollouts do not model, such as putting an item down on the
    way."""
    if made.look_on_the_way:
        return _look_step(made.look_on_the_way[0], delivery)
    step = next((s for s in made.plan.steps if s.action in ("find", "pick", "place")), None)
    if step is None:
        return None
    if step.action == "find":
        return _look_step(made.search_order[0].container, delivery)
    types = [want.item_type for want in delivery.wants]
    if step.item_types[0] not in types:
        return None
    want = types.index(step.item_types[0])
    if delivery.situation.done >> want & 1 or (step.action == "place" and step.origin != delivery.wants[want].at):
        return None
    return FirstStep(FETCH, want)


def _look_step(place: str, delivery: Delivery) -> FirstStep | None:
    container = ContainerId(place)
    return FirstStep(LOOK, delivery.containers.index(container)) if container in delivery.containers else None


def best_first_step(
    own: FirstStep, delivery: Delivery, *, looks: int, worlds: int, seed: tuple[int, ...]
) -> FirstStep:
    """The step of least mean delivery cost over sampled worlds: the decision's own or an alternative (choice.py)."""
    even, uniform = _random_numbers(seed, len(delivery.open), worlds, len(delivery.containers))
    move, leads_to = choice.best_first_step(own.move(delivery), looks, delivery.situation, even, uniform)
    n = len(delivery.containers)
    return FirstStep(LOOK, move, leads_to) if move < n else FirstStep(FETCH, move - n, leads_to)


@lru_cache(maxsize=DRAWN_SIZE)
def _random_numbers(seed: tuple[int, ...], wants: int, worlds: int, containers: int) -> tuple[Floats, Floats]:
    """Random numbers in [0, 1) for each want, of shapes (wants, worlds), stratified, and (wants, worlds, containers);
    cached, since states after as many looks at the same place draw the same."""
    rng = np.random.default_rng(seed)
    even, uniform = np.empty((wants, worlds)), np.empty((wants, worlds, containers))
    for want in range(wants):
        even[want] = (rng.permutation(worlds) + rng.random(worlds)) / worlds
        rng.random(out=uniform[want])
    return even, uniform


def with_first_step(step: FirstStep, made: Decision, delivery: Delivery, view: View) -> Decision:
    """The decision with another first step; the robot replans after it."""
    if step.kind == LOOK:
        return replace(made, look_on_the_way=(LocationId(delivery.containers[step.target]),))
    want = delivery.wants[step.target]
    place = view.knowledge.travel.locations[step.leads_to]
    item = next(i for at, i in view.knowledge.where(want.item_type) if at == place)
    steps = (
        *_move(view.knowledge.robot_at, place, view),
        _handle("pick", place, item, view),
        *_move(place, want.at, view),
        _handle("place", want.at, item, view),
    )
    plan = Plan(
        status=PlanStatus.SOLVED,
        steps=steps,
        cost=sum(s.cost for s in steps),
        solver=SOLVER,
        note=f"{want.item_type} first; the rest is planned after it",
    )
    return replace(made, plan=plan, look_on_the_way=())


def _handle(action: str, at: LocationId, item: Item, view: View) -> PlanStep:
    about = (item.type,), (item.id,)
    cost = view.costs.manipulation
    return PlanStep(action=action, origin=at, target=at, item_types=about[0], items=about[1], cost=cost)


def _move(origin: LocationId, target: LocationId, view: View) -> tuple[PlanStep, ...]:
    if origin == target:
        return ()
    metres = view.knowledge.travel.between(origin, target) or 0.0
    return (PlanStep(action="move", origin=origin, target=target, cost=metres),)
