"""Comparison of alternative first steps by rollouts in worlds sampled from the belief.

Candidates are the decision's own first step, the most promising looks (for one missing item, for all of them, and
relative to the detour from the planned route), and fetching each known item. The policy of kernels.py continues
each of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from workbench.arrays import Bools, Floats
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.rollouts import kernels as rollouts
from workbench.planning.rollouts.kernels import FETCH, LOOK
from workbench.planning.rollouts.situations import Delivery
from workbench.planning.strategy import Decision, View
from workbench.search.ties import first_least, ranked, tolerance
from workbench.worlds.house import ContainerId, Item, LocationId

SOLVER = "rollouts"
SCREENING_FRACTION, REJECT_STANDARD_ERRORS = 6, 2.0
"""All steps are tried in a sixth of the worlds; those worse than the best by two standard errors are then dropped."""
NEGLIGIBLE_DETOUR_M = 0.5
"""Detours shorter than this many metres count as zero when looks are ranked."""


@dataclass(frozen=True, slots=True)
class FirstStep:
    """FETCH a want, or LOOK into a container, by index in the delivery."""

    kind: int
    target: int


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


def alternative_first_steps(own: FirstStep, delivery: Delivery, *, looks: int) -> tuple[FirstStep, ...]:
    """Alternative first steps with at most `looks` looks; empty if nothing is left to find."""
    here = delivery.situation
    if not delivery.open or not here.chance.any():
        return ()
    errands = [FirstStep(FETCH, k) for k in delivery.open if here.known[k] > 0] if here.hand < 0 else []
    chance = here.chance[list(delivery.open)]
    everything = chance.sum(axis=0)
    from_m = here.metres[here.robot, here.containers]
    to_m = here.metres[here.containers[:, None], here.targets[list(delivery.open)]]
    onward = _next_place(own, delivery)
    detour = from_m + here.metres[here.containers, onward] - here.metres[here.robot, onward]
    worths = [
        (chance / (1.0 + from_m + to_m.T / 2.0)).max(axis=0),
        everything / (1.0 + from_m),
        everything / (NEGLIGIBLE_DETOUR_M + detour),
    ]
    mixed = dict.fromkeys(ranked(np.stack(worths), min_scale=0.0).T.ravel().tolist())
    promising = [FirstStep(LOOK, a) for a in islice((a for a in mixed if everything[a] > 0), looks)]
    return tuple(step for step in (*errands, *promising) if step != own)


def _next_place(own: FirstStep, delivery: Delivery) -> int:
    """The location of the decision's first step."""
    here = delivery.situation
    if own.kind == LOOK:
        return int(here.containers[own.target])
    if here.hand == own.target:
        return int(here.targets[own.target])
    return _best_instance(own.target, delivery)


def _best_instance(want: int, delivery: Delivery) -> int:
    here = delivery.situation
    standing = here.places[want, : here.known[want]]
    detours = here.metres[here.robot, standing] + here.metres[standing, here.targets[want]]
    return int(standing[first_least(detours)])


def best_first_step(
    steps: tuple[FirstStep, ...], delivery: Delivery, *, worlds: int, rng: np.random.Generator
) -> FirstStep:
    """The step with the least mean delivery cost over sampled worlds; ties go to the earlier step.

    All steps are tried in the first worlds; only those not clearly worse than the best are tried in the rest.
    """
    held = _sample_worlds(delivery, worlds, rng)
    few = max(worlds // SCREENING_FRACTION, 1)
    costs = _costs(steps, delivery, held[:few])
    means = costs.mean(axis=1)
    behind = costs - costs[first_least(means)]
    apart = REJECT_STANDARD_ERRORS * behind.std(axis=1) / np.sqrt(few)
    kept = np.flatnonzero(behind.mean(axis=1) <= apart + tolerance(float(means.min())))
    if len(kept) > 1 and few < worlds:
        left = tuple(steps[i] for i in kept)
        costs = np.concatenate([costs[kept], _costs(left, delivery, held[few:])], axis=1)
        return left[first_least(costs.mean(axis=1))]
    return steps[first_least(means)]


def _sample_worlds(delivery: Delivery, worlds: int, rng: np.random.Generator) -> Bools:
    """Sampled worlds: whether each container holds each wanted type; bool, shape (worlds, wants, containers)."""
    here = delivery.situation
    wants, n = here.chance.shape
    held = np.zeros((worlds, wants, n), dtype=np.bool_)
    for k in delivery.open:
        even = (rng.permutation(worlds) + rng.random(worlds)) / worlds
        rollouts.sample_worlds(here.chance[k], bool(here.sought[k]), even, rng.random((worlds, n)), held[:, k])
    return held


def _costs(steps: tuple[FirstStep, ...], delivery: Delivery, held: Bools) -> Floats:
    """Rollout costs in cost units, shape (steps, worlds)."""
    kinds = np.array([step.kind for step in steps], dtype=np.int64)
    targets = np.array([step.target for step in steps], dtype=np.int64)
    return rollouts.rollout_costs(kinds, targets, delivery.situation, held)


def with_first_step(step: FirstStep, made: Decision, delivery: Delivery, view: View) -> Decision:
    """The decision with another first step; the robot replans after it."""
    if step.kind == LOOK:
        return replace(made, look_on_the_way=(LocationId(delivery.containers[step.target]),))
    want, travel = delivery.wants[step.target], view.knowledge.travel
    place = travel.locations[_best_instance(step.target, delivery)]
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
