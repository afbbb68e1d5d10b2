"""A decision of a strategy that delivers things as they are, carried out up to its look, compiled with numba.

It goes by the same numbers as the strategy itself: the find costs, the cheapest plan and where the policy looks
first, in one call. A tree of runs needs of most decisions only where they lead. What is nearly a tie is not decided
here: then the strategy is asked. Tests compare the two.
"""

# pyright: reportMissingTypeStubs=false, reportUntypedFunctionDecorator=false

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replayers.counterfactual.decisions.one_plan import parts_left
from workbench.arrays import Bools, Floats, Indices, Ints
from workbench.planning.builtin.delivery_orders import cheapest_delivery
from workbench.search.candidates import NEAREST_KEPT
from workbench.search.compiled import fill_cost_table, search_order, subset_layers
from workbench.search.compiled_remaining import greatest, missing_by_subset
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, RELATIVE

ASK, MET, LOOK, DELIVERED = 0, 1, 2, 3
"""How a decision ends: the strategy is to be asked; the goal is met; before a look; all is delivered."""
WALK, PICK, PLACE = 0, 1, 2
"""What is done on the way; with the place, or with the part of the goal and the number of the item."""


class DeliveryTask(NamedTuple):
    """Deliveries of different types, as they are, in one place.

    Attributes:
        metres: between all locations, shape (locations, locations).
        name_rank: of each location by its name, shape (locations,).
        wanted: where each part is wanted, shape (parts,).
        wanted_by_name: the same places, each once, by name.
        may_find: whether a find of a part's type is offered where none is known, shape (parts,).
        orders: every order of 1, 2, ... parts, one below the other and padded, shape (orders, parts).
        first_order: in which row those of so many parts begin, shape (parts + 2,).
        search, manipulation: costs of a look, and of a pick or a place.
    """

    metres: Floats
    name_rank: Ints
    wanted: Ints
    wanted_by_name: Ints
    may_find: Bools
    orders: Ints
    first_order: Ints
    search: float
    manipulation: float


class DecisionRules(NamedTuple):
    """By what a strategy decides.

    Attributes:
        eq1_plans: finds cost what Eq. 1 says; else the detour to the nearest container and `penalty`.
        eq1_looks: a search looks where Eq. 1 says; else into the nearest container.
        penalty: added to every find.
        kind: the formula of R (remaining.KINDS).
        by_worth: candidates are ranked by worth; else by probability.
        limit: how many candidates.
        clearly: how many tolerances a plan must be cheaper than every other (builtin/deliveries.py).
        max_nodes: of the search for a plan that puts things down on the way.
        operations: op_slot, op_where, op_after and link of a recipe without operations.
    """

    eq1_plans: bool
    eq1_looks: bool
    penalty: float
    kind: int
    by_worth: bool
    limit: int
    clearly: float
    max_nodes: int
    operations: tuple[Ints, Ints, Ints, Ints]


class Carried(NamedTuple):
    """What a decision led to.

    Attributes:
        ends: ASK, MET, LOOK or DELIVERED.
        look: where `left` is looked into; -1 for nowhere.
        cost: of everything before, and of what was done.
        picks: how many of the acts are.
        acts: one a row: WALK and the place; PICK and PLACE with the part, and the number of the item.
    """

    ends: int
    look: int
    cost: float
    picks: int
    acts: Ints


@kernel()
def carried_out(
    task: DeliveryTask,
    rules: DecisionRules,
    here: int,
    cost: float,
    at: Ints,
    left: Indices,
    chances: Floats,
    weights: Floats,
) -> Carried:
    """One decision, carried out until the robot stands where it looks, or has delivered all.

    Args:
        here: where the robot stands, with an empty hand.
        cost: of everything before.
        at: where the known items of each part's type are, by their ids, padded with -1, shape (parts, items).
        left: where the containers are that are left, shape (containers,).
        chances, weights: of each part's type in these, and what R is made of (remaining.weights), shape (parts,
            containers); of no rows for a strategy that goes by distance alone.
    """
    nothing = np.empty((0, 3), np.int64)
    unmet = parts_left(at, task.wanted)
    if len(unmet) == 0:
        return Carried(MET, -1, cost, 0, nothing)
    missing, is_possible = _missing(task, at, len(left))
    if not is_possible:
        return Carried(ASK, -1, cost, 0, nothing)
    places, number = _places(task, here, at)
    tables = np.zeros((len(missing), len(places), len(places)))
    if rules.eq1_plans and len(missing):
        p, w = np.empty((len(missing), len(left))), np.empty((len(missing), len(left)))
        for k in range(len(missing)):
            for c in range(len(left)):
                p[k, c], w[k, c] = chances[missing[k], c], weights[missing[k], c]
        _eq1_tables(tables, task, rules, places, left, p, w)
    elif len(missing):
        _distance_tables(tables, task, rules, places, left)
    legs = _cheapest_legs(task, rules, tables, places, number, at, unmet, missing)
    if len(legs) == 0:
        return Carried(ASK, -1, cost, 0, nothing)
    return _along(task, rules, here, cost, at, left, (places, legs), (chances, weights))


@kernel()
def _missing(task: DeliveryTask, at: Ints, containers: int) -> tuple[Ints, bool]:
    """The parts of whose types no item is known, and whether a find of each of these is offered."""
    missing, count, is_possible = np.empty(len(at), np.int64), 0, True
    for s in range(len(at)):
        if at[s, 0] < 0:
            missing[count] = s
            count += 1
            is_possible &= task.may_find[s] and containers > 0
    return missing[:count], is_possible


@kernel()
def _places(task: DeliveryTask, here: int, at: Ints) -> tuple[Ints, Ints]:
    """The places of the planning problem, as of problem.relevant_locations, and the number of each location among
    them, or -1."""
    locations = len(task.metres)
    number, rank = np.full(locations, -1), np.full(locations, -1)
    places = np.empty(1 + len(task.wanted) + at.size, np.int64)
    places[0], number[here], count = here, 0, 1
    for place in task.wanted_by_name:
        if number[place] < 0:
            places[count], number[place] = place, count
            count += 1
    for s in range(at.shape[0]):
        for j in range(at.shape[1]):
            if at[s, j] >= 0 and number[at[s, j]] < 0:
                rank[task.name_rank[at[s, j]]] = at[s, j]
    for place in rank:
        if place >= 0:
            places[count], number[place] = place, count
            count += 1
    return places[:count], number


@kernel()
def _distance_tables(tables: Floats, task: DeliveryTask, rules: DecisionRules, places: Ints, left: Indices) -> None:
    """Optimistic and pessimistic find costs (search/bounds.py)."""
    for a in range(len(places)):
        for b in range(len(places)):
            least = np.inf
            for container in left:
                least = min(least, task.metres[places[a], container] + task.metres[container, places[b]])
            for t in range(len(tables)):
                tables[t, a, b] = least + task.search + task.manipulation + rules.penalty


@kernel()
def _eq1_tables(
    tables: Floats, task: DeliveryTask, rules: DecisionRules, places: Ints, left: Indices, p: Floats, w: Floats
) -> None:
    """Find costs by Eq. 1 (search/engine.py)."""
    n, containers = len(places), len(left)
    from_m, to_m = np.zeros(containers), np.zeros(containers)
    for c in range(containers):
        for a in range(n):
            from_m[c] += task.metres[places[a], left[c]]
            to_m[c] += task.metres[left[c], places[a]]
    chosen = _candidates(p, from_m / n, to_m / n, rules)
    k = chosen.shape[1]
    missing = missing_by_subset(w, chosen, rules.kind)
    between, origins = np.empty((len(p), k, k)), np.empty((len(p), n, k))
    found = np.empty((len(p), k, n))
    for t in range(len(p)):
        for i in range(k):
            one = left[chosen[t, i]]
            for j in range(k):
                between[t, i, j] = task.metres[one, left[chosen[t, j]]]
            for a in range(n):
                origins[t, a, i] = task.metres[places[a], one]
                found[t, i, a] = task.manipulation + task.metres[one, places[a]]
    fill_cost_table(missing, between, origins, found, np.zeros_like(found), task.search, subset_layers(k), tables)
    for t in range(len(p)):
        for a in range(n):
            for b in range(n):
                tables[t, a, b] = max(tables[t, a, b], 0.0)


@kernel()
def _candidates(p: Floats, from_m: Floats, to_m: Floats, rules: DecisionRules) -> Indices:
    """candidates.choose."""
    containers = p.shape[1]
    count = min(rules.limit, containers)
    score = p.copy()
    if rules.by_worth:
        for t in range(len(p)):
            for c in range(containers):
                score[t, c] = p[t, c] / (1.0 + from_m[c] + to_m[c] / 2.0)
        return greatest(score, count)
    near = np.empty((1, containers))
    for c in range(containers):
        near[0, c] = -(from_m[c] + to_m[c])
    for c in greatest(near, min(NEAREST_KEPT, count))[0]:
        for t in range(len(p)):
            score[t, c] = 2.0
    return greatest(score, count)


@kernel(inline="always")
def _cheapest_legs(
    task: DeliveryTask,
    rules: DecisionRules,
    tables: Floats,
    places: Ints,
    number: Ints,
    at: Ints,
    unmet: Ints,
    missing: Ints,
) -> Ints:
    """The errands of the plan that is clearly the cheapest, in order: part, number of the item, and the places
    between which a missing one is found; of no rows where none is."""
    parts, count = len(task.wanted), len(unmet)
    slot_at, find = np.full(at.shape, -1), np.full(at.shape, -1)
    ends = np.empty(parts, np.int64)
    for s in range(parts):
        ends[s] = number[task.wanted[s]]
        for j in range(at.shape[1]):
            slot_at[s, j] = number[at[s, j]] if at[s, j] >= 0 else -1
    for k in range(len(missing)):
        find[missing[k], 0] = k
    first, last = task.first_order[count], task.first_order[count + 1]
    orders = np.empty((last - first, count), np.int64)
    for p in range(len(orders)):
        for q in range(count):
            orders[p, q] = unmet[task.orders[first + p, q]]
    row, _, _, found = cheapest_delivery(
        task.metres, places, tables, slot_at, find, ends, np.zeros(parts, np.int64), rules.operations, np.int64(0),
        task.manipulation, orders, rules.clearly, rules.max_nodes,
    )  # fmt: skip
    legs = np.empty((count if row >= 0 else 0, 4), np.int64)
    for q in range(len(legs)):
        legs[q, 0], legs[q, 1], legs[q, 2], legs[q, 3] = orders[row, q], found[q, 0], found[q, 1], found[q, 2]
    return legs


@kernel(inline="always")
def _along(
    task: DeliveryTask,
    rules: DecisionRules,
    here: int,
    cost: float,
    at: Ints,
    left: Indices,
    plan: tuple[Ints, Ints],
    belief: tuple[Floats, Floats],
) -> Carried:
    """A plan, carried out: its places, and its errands as of _cheapest_legs."""
    places, legs = plan
    acts, count, picks = np.zeros((4 * len(legs) + 2, 3), np.int64), 0, 0
    for q in range(len(legs)):
        s, j, begin, end = int(legs[q, 0]), int(legs[q, 1]), int(legs[q, 2]), int(legs[q, 3])
        known = int(at[s, j])
        to = known if known >= 0 else int(places[begin])
        if to != here:
            cost += task.metres[here, to]
            acts[count, 0], acts[count, 1], here, count = WALK, to, to, count + 1
        if known < 0:
            p, w = belief[0][s : s + 1], belief[1][s : s + 1]
            look = _first_look(task, rules, here, int(places[end]), left, p, w)
            to = int(left[look])
            if to != here:
                cost += task.metres[here, to]
                acts[count, 0], acts[count, 1], count = WALK, to, count + 1
            return Carried(LOOK, look, cost, picks, acts[:count])
        acts[count, 0], acts[count, 1], acts[count, 2], count = PICK, s, j, count + 1
        cost, picks, to = cost + task.manipulation, picks + 1, int(task.wanted[s])
        if to != here:
            cost += task.metres[here, to]
            acts[count, 0], acts[count, 1], here, count = WALK, to, to, count + 1
        acts[count, 0], acts[count, 1], acts[count, 2], count = PLACE, s, j, count + 1
        cost += task.manipulation
    return Carried(DELIVERED, -1, cost, picks, acts[:count])


@kernel()
def _first_look(
    task: DeliveryTask, rules: DecisionRules, here: int, target: int, left: Indices, p: Floats, w: Floats
) -> int:
    """Where a search for one type looks first (policies/nearest_first.py, policies/least_expected_cost.py)."""
    containers = len(left)
    from_m, to_m = np.empty(containers), np.empty(containers)
    for c in range(containers):
        from_m[c], to_m[c] = task.metres[here, left[c]], task.metres[left[c], target]
    if not rules.eq1_looks:
        least = np.inf
        for c in range(containers):
            least = min(least, from_m[c])
        for c in range(containers):
            if from_m[c] <= least + RELATIVE * max(MIN_SCALE, least):
                return c
        return 0
    chosen = _candidates(p, from_m, to_m, rules)
    k = chosen.shape[1]
    between, origin, found = np.empty((k, k)), np.empty(k), np.empty(k)
    for i in range(k):
        origin[i], found[i] = from_m[chosen[0, i]], task.manipulation + to_m[chosen[0, i]]
        for j in range(k):
            between[i, j] = task.metres[left[chosen[0, i]], left[chosen[0, j]]]
    missing = missing_by_subset(w, chosen, rules.kind)[0]
    return chosen[0, search_order(missing, between, origin, found, task.search)[0]]
