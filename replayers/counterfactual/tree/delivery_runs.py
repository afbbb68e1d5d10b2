"""Decisions of built-in strategies that deliver things as they are, without asking them (delivery_kernel.py)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import accumulate, permutations
from typing import final

import numpy as np

from replayers.counterfactual.decisions.needed_items import NeededItems
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.tree.delivery_kernel import (
    ASK,
    MET,
    PICK,
    PLACE,
    WALK,
    DecisionRules,
    DeliveryTask,
    carried_out,
)
from workbench.arrays import Floats, Indices, Ints
from workbench.beliefs.belief import Belief
from workbench.caches import Cache
from workbench.planning.builtin.attempts import has_codes_of_all
from workbench.planning.builtin.deliveries import CLEARLY, MAX_DELIVERIES, plan_step
from workbench.planning.builtin.recipe_arrays import EMPTY_OPERATIONS
from workbench.planning.builtin.solver import POLISH_NODES, QUICK_S
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Expected, Optimistic, Pessimistic
from workbench.planning.plans import PlanStep
from workbench.planning.solvers.protocol import BuiltIn
from workbench.planning.tasks import Delivered, distinct_deliveries, goal_locations
from workbench.search.bounds import PESSIMISTIC_PENALTY
from workbench.search.candidates import Ranking, ranking_of
from workbench.search.find_costs import BeliefModel
from workbench.search.policies.least_expected_cost import LeastExpectedCost
from workbench.search.policies.nearest_first import NearestFirst
from workbench.search.remaining import KINDS, weights
from workbench.worlds.house import ContainerId, Item, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

MAX_SETS_OF_CONTAINERS = 20_000
"""Sets of containers left whose beliefs are kept."""
NO_BELIEF = np.empty((0, 0))

Believed = Callable[[Knowledge], Belief]
"""The belief for a decision; which containers are left is all that it depends on."""
Acts = list[list[int]]
"""Rows of delivery_kernel.Carried.acts."""


@dataclass(frozen=True, slots=True)
class CarriedOut:
    """A decision, carried out until the robot stands where it looks, or has delivered all.

    Attributes:
        knowledge: what the robot then knows.
        cost: of everything before, and of what was done.
        acts: what was done, as of delivery_kernel.Carried.
        picks: how many of the acts are.
        look: what it looks into; None where all is delivered, or was before.
    """

    knowledge: Knowledge
    cost: float
    acts: Acts
    picks: int
    look: ContainerId | None


@dataclass(frozen=True, slots=True)
class _Left:
    """The containers that are left, and what is believed of them; arrays as of carried_out."""

    containers: tuple[ContainerId, ...]
    at: Indices
    chances: Floats
    weights: Floats


@final
class DeliveryRuns:
    """Decisions of one strategy over one log; made by delivery_runs."""

    def __init__(
        self,
        evidence: Evidence,
        wants: tuple[Delivered, ...],
        rules: DecisionRules,
        model: BeliefModel | None,
        believed: Believed,
        needed: NeededItems | None,
    ) -> None:
        self._travel = evidence.travel
        self._types = tuple(want.item_type for want in wants)
        self._task = _task_of(evidence, wants)
        self._rules = rules
        self._model: BeliefModel | None = model
        self._believed = believed
        self._needed = needed
        self._left: Cache[tuple[ContainerId, ...], _Left] = Cache(MAX_SETS_OF_CONTAINERS)

    def carry_out(self, knowledge: Knowledge, cost: float) -> CarriedOut | None:
        """One decision, carried out; None where the strategy is to be asked.

        Args:
            cost: of everything before.
        """
        if knowledge.holding is not None or knowledge.travel is not self._travel:
            return None
        index, locations = self._travel.index, self._travel.locations
        known = [_by_id(knowledge, item_type) for item_type in self._types]
        most = max(1, *map(len, known))
        at = [[*[index(place) for place, _ in one], *[-1] * (most - len(one))] for one in known]
        left = self._left.get(knowledge.unsearched, lambda: self._what_is_left(knowledge))
        here = index(knowledge.robot_at)
        places = np.array(at)
        ends, look, cost, picks, acts = carried_out(
            self._task, self._rules, here, cost, places, left.at, left.chances, left.weights
        )
        if ends == MET:
            return CarriedOut(knowledge, cost, [], 0, None)
        if ends == ASK or not self._is_clear(here, places, left.at, knowledge):
            return None
        done, listed = knowledge, acts.tolist()
        for kind, what, number in listed:
            if kind == WALK:
                here = what
            elif kind == PLACE:
                origin, item = known[what][number]
                done = done.brought(item, origin, locations[here])
        if locations[here] != done.robot_at:
            done = done.moved(locations[here])
        container = left.containers[look] if look >= 0 else None
        return CarriedOut(done, float(cost), listed, picks, container)  # also where nothing is compiled

    def _is_clear(self, here: int, at: Ints, left: Indices, knowledge: Knowledge) -> bool:
        """Whether what distinguishes states decides."""
        return self._needed is None or self._needed.one_plan_is_best_at(here, at, left, knowledge)

    def steps_of(self, knowledge: Knowledge, acts: Acts) -> tuple[PlanStep, ...]:
        """The acts of a decision in a state, as steps of its plan."""
        locations, robot, steps = self._travel.locations, knowledge.robot_at, list[PlanStep]()
        for kind, what, number in acts:
            if kind == WALK:
                target = locations[what]
                steps.append(plan_step("move", robot, target, (), (), self._travel.between(robot, target) or 0.0))
                robot = target
                continue
            item = _by_id(knowledge, self._types[what])[number][1]
            action = "pick" if kind == PICK else "place"
            steps.append(plan_step(action, robot, robot, (item.type,), (item.id,), self._task.manipulation))
        return tuple(steps)

    def _what_is_left(self, knowledge: Knowledge) -> _Left:
        if self._model is None:
            containers = knowledge.unsearched
            return _Left(containers, self._travel.rows(containers), NO_BELIEF, NO_BELIEF)
        belief = self._believed(knowledge)
        containers = belief.containers
        chances, made_of = NO_BELIEF, NO_BELIEF
        if containers:
            nothing = np.zeros(len(containers))
            rows = [belief.of(t) if t in belief.item_types else nothing for t in self._types]
            chances = np.array(rows)
            made_of = weights(chances, self._model)
        return _Left(containers, self._travel.rows(containers), chances, made_of)


def delivery_runs(
    evidence: Evidence, planner: Composed, believed: Believed, needed: NeededItems | None
) -> DeliveryRuns | None:
    """The decisions of a strategy over a plain log; None for strategies, tasks and places of another kind.

    Args:
        planner: what the strategy is made of.
        needed: of items that still matter, which distinguish states; None where all do.
    """
    wants, travel = distinct_deliveries(evidence.task.goal), evidence.travel
    if not 0 < len(wants) <= MAX_DELIVERIES or evidence.task.budget_s < QUICK_S or travel.unreachable:
        return None
    places = [*[LocationId(c.id) for c in evidence.place.plan.containers], *[want.at for want in wants]]
    if not all(map(travel.reaches, places)) or not has_codes_of_all(len(travel.locations), len(wants)):
        return None
    found = _rules_of(planner)
    return None if found is None else DeliveryRuns(evidence, wants, *found, believed, needed)


@dataclass(frozen=True, slots=True)
class _Eq1:
    """Eq. 1 as a strategy uses it; attributes as the arguments of engine.expected_find_costs."""

    belief_model: BeliefModel
    ranking: Ranking
    limit: int


def _rules_of(planner: Composed) -> tuple[DecisionRules, BeliefModel | None] | None:
    """By what a strategy decides, and the model of its beliefs, None for distance alone; None where the kernel
    does not know how it decides."""
    pricing, policy = planner.pricing, planner.policy
    is_known = isinstance(pricing, Optimistic | Pessimistic | Expected) and isinstance(
        policy, NearestFirst | LeastExpectedCost
    )
    of_kind = isinstance(planner.solver, BuiltIn) and not (planner.find_known or planner.everywhere)
    if not of_kind or planner.looks_again or not is_known:
        return None
    plans = looks = None
    if isinstance(pricing, Expected):
        plans = _Eq1(pricing.belief_model, ranking_of(pricing.belief_model), pricing.limit)
    if isinstance(policy, LeastExpectedCost):
        looks = _Eq1(policy.belief_model, policy.ranking, policy.limit)
    of_one_find = isinstance(pricing, Expected) and pricing.per_find
    if of_one_find or (plans is not None and looks is not None and plans != looks):
        return None
    eq1 = plans or looks
    rules = DecisionRules(
        eq1_plans=plans is not None,
        eq1_looks=looks is not None,
        penalty=PESSIMISTIC_PENALTY if isinstance(pricing, Pessimistic) else 0.0,
        kind=KINDS[eq1.belief_model] if eq1 is not None else 0,
        by_worth=eq1 is not None and eq1.ranking == "worth",
        limit=eq1.limit if eq1 is not None else 1,
        clearly=CLEARLY,
        max_nodes=POLISH_NODES,
        operations=EMPTY_OPERATIONS,
    )
    return rules, eq1.belief_model if eq1 is not None else None


def _task_of(evidence: Evidence, wants: tuple[Delivered, ...]) -> DeliveryTask:
    travel, available = evidence.travel, evidence.task.available
    names, parts = travel.locations, len(wants)
    rank = np.empty(len(names), dtype=np.int64)
    rank[sorted(range(len(names)), key=lambda place: names[place])] = np.arange(len(names))
    orders = [[*order, *[0] * (parts - n)] for n in range(1, parts + 1) for order in permutations(range(n))]
    counts = [0, *(sum(1 for _ in permutations(range(n))) for n in range(1, parts + 1))]
    return DeliveryTask(
        metres=travel.metres,
        name_rank=rank,
        wanted=np.array([travel.index(want.at) for want in wants]),
        wanted_by_name=np.array([travel.index(at) for at in goal_locations(evidence.task.goal)]),
        may_find=np.array([not available or want.item_type in available for want in wants]),
        orders=np.array(orders),
        first_order=np.array([0, *accumulate(counts)]),
        search=float(evidence.costs.search),
        manipulation=float(evidence.costs.manipulation),
    )


def _by_id(knowledge: Knowledge, item_type: ItemType) -> list[tuple[LocationId, Item]]:
    """The known instances of a type by their ids, as planning problems list them."""
    known = knowledge.where(item_type)
    return sorted(known, key=lambda one: one[1].id) if len(known) > 1 else list(known)
