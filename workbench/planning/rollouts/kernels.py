"""Rollouts: the cost of each candidate first step, followed by a simple policy, in sampled worlds; compiled with
numba.

A world states for every wanted type which unsearched containers hold it. It is sampled from the belief: a missing
type that exists has at least one instance, a known type any number. The continuation policy replans after every
look, as ConditionedLIOS does: legs of known items cost their distance, legs of missing items cost Eq. 1 over the
candidates not yet searched; the cheapest order of deliveries is chosen, and its first leg is walked, or the first
look of its search is taken. All first steps are tried in the same worlds, so that costs can be compared pairwise.

`_find_cost` is the one function that is not inlined: it is called at two places, and inlined at both it takes half as
long again to compile, while the rollouts take as long.

Import this module lazily: importing numba takes most of a second.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.arrays import Bools, Floats, Ints
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, NO_CHANCE, RELATIVE

FETCH, LOOK = 0, 1
"""Kinds of first steps: fetch (or go on carrying) a wanted item and deliver it; look into a container."""

MAX_STEPS = 400
FAILURE_COST = 1e4
"""Cost of a world in which the policy cannot complete the delivery."""

MIN_REMAINING_PROBABILITY = 1e-9
"""A find with no more than this chance of coming to a next candidate has none left."""


class DeliveryState(NamedTuple):
    """The state of a delivery as arrays, with K wants, n unsearched containers, L locations and c candidates.

    Attributes:
        metres: travel distances, shape (L, L).
        containers, targets: location indices of the containers, shape (n,), and of the wants' targets, shape (K,).
        alternatives: bit masks of wants; meeting all wants of any one mask meets the goal.
        done: bit mask of the wants already met.
        hand: index of the want whose item is held, or -1.
        robot: location index.
        places, known: location indices of known instances, shape (K, any), and their number, shape (K,).
        sought: whether a find may be planned, shape (K,).
        chance: probability that a container holds the type, not conditioned on existence
            (remaining.unconditioned), shape (K, n).
        candidates: container indices of the candidates of Eq. 1, shape (K, c); number: the inverse, -1 for
            none, shape (K, n).
        missing: remaining.still_missing_by_subset, shape (K, 2**c).
        onward: expected cost still to come after a subset has been searched, by the last one searched, shape
            (K, 2**c, c).
        beyond: cost of a find after all candidates have been searched, shape (K,).
        look, handle: action costs in cost units.
    """

    metres: Floats
    containers: Ints
    targets: Ints
    alternatives: Ints
    done: int
    hand: int
    robot: int
    places: Ints
    known: Ints
    sought: Bools
    chance: Floats
    candidates: Ints
    number: Ints
    missing: Floats
    onward: Floats
    beyond: Floats
    look: float
    handle: float


class Scratch(NamedTuple):
    """Scratch arrays that all rollouts share, one after the other.

    Attributes:
        searched: searched containers, shape (n,); subset: bit mask of each want's searched candidates, shape (K,).
        places, known: as in DeliveryState, plus the instances found since.
        legs: cost of delivering each want from the robot's location (row 0) and from each target, shape (K + 1, K).
        rest: cost of the remaining wants (a mask), by the want delivered last, shape (2**K, K + 1).
        finds: cache of find costs across worlds, by origin (containers, then targets of wants), want and
            subset, shape (n + K, K, 2**c); is_known: which entries are filled.
    """

    searched: Bools
    subset: Ints
    known: Ints
    places: Ints
    legs: Floats
    rest: Floats
    finds: Floats
    is_known: Bools


@kernel()
def remaining_cost_table(missing: Floats, between_m: Floats, found: Floats, beyond: float, look: float) -> Floats:
    """The table of Eq. 1 for one type: reference.cost_table before its last step, shape (2**c, c)."""
    c = len(found)
    everything = (1 << c) - 1
    table = np.zeros((1 << c, c))
    table[everything] = missing[everything] * beyond
    for subset in range(everything - 1, 0, -1):
        r = missing[subset]
        for i in range(c):
            if subset >> i & 1:
                best = np.inf
                for a in range(c):
                    if not subset >> a & 1:
                        after = subset | 1 << a
                        cost = r * (between_m[i, a] + look) + (r - missing[after]) * found[a] + table[after, a]
                        best = min(best, cost)
                table[subset, i] = best
    return table


@kernel()
def sample_worlds(chance: Floats, exists: bool, even: Floats, uniform: Floats, held: Bools) -> None:
    """Sample worlds of one item type.

    Args:
        chance: probability of each container, below 1, shape (n,).
        exists: at least one container holds it; `even` then selects the first one, so that stratified numbers
            give stratified worlds.
        even, uniform: random numbers in [0, 1), shapes (worlds,) and (worlds, n).
        held: output, whether each container holds the type, shape (worlds, n).
    """
    worlds, n = held.shape
    none = 1.0
    for a in range(n):
        none *= 1.0 - chance[a]
    for w in range(worlds):
        first = 0
        if exists:
            upto, miss = 0.0, 1.0
            wanted = even[w] * (1.0 - none)
            for first in range(n):
                upto += miss * chance[first]
                miss *= 1.0 - chance[first]
                if wanted < upto:
                    break
        for a in range(n):
            held[w, a] = uniform[w, a] < chance[a]
            if exists and a <= first:
                held[w, a] = a == first


@kernel()
def rollout_costs(kinds: Ints, targets: Ints, here: DeliveryState, held: Bools) -> Floats:
    """The cost of each first step, continued by the policy, in each world, shape (steps, worlds).

    Args:
        kinds: FETCH or LOOK; targets: index of a want or of a container; both of shape (steps,).
        held: whether each container holds each wanted type, shape (worlds, K, n).
    """
    answer = np.empty((len(kinds), len(held)))
    wants, n = len(here.targets), len(here.containers)
    room = Scratch(
        searched=np.zeros(n, np.bool_),
        subset=np.zeros(wants, np.int64),
        known=here.known.copy(),
        places=here.places.copy(),
        legs=np.empty((wants + 1, wants)),
        rest=np.zeros((1 << wants, wants + 1)),
        finds=np.empty((n + wants, wants, here.missing.shape[1])),
        is_known=np.zeros((n + wants, wants, here.missing.shape[1]), np.bool_),
    )
    for w in range(len(held)):
        for step in range(len(kinds)):
            answer[step, w] = _rollout(kinds[step], targets[step], here, held[w], room)
    return answer


@kernel(inline="always")
def _rollout(kind: int, target: int, here: DeliveryState, held: Bools, room: Scratch) -> float:
    searched, subset, known, places, legs, rest, finds, is_known = room
    wants, n = len(here.targets), len(here.containers)
    for a in range(n):
        searched[a] = False
    for k in range(wants):
        subset[k], known[k] = 0, here.known[k]
    at, begin, hand, done = here.robot, -1, here.hand, here.done
    cost = 0.0
    for step in range(MAX_STEPS):
        for alternative in here.alternatives:
            if alternative & ~done == 0:
                return cost
        if step > 0:
            kind, target = FETCH, hand
            if hand < 0:
                _fill_legs(legs, here, at, begin, done, known, places, subset, finds, is_known)
                target = _first_want_of_best_order(legs, rest, here.alternatives, done)
                if target < 0:
                    return cost + FAILURE_COST
                if known[target] == 0:
                    kind, target = LOOK, _next_look(here, target, at, subset[target], searched)
                    if target < 0:
                        return cost + FAILURE_COST
        if kind == FETCH:
            goal = here.targets[target]
            if hand == target:
                cost += here.metres[at, goal] + here.handle
            else:
                cost += _known_instance_cost(here, target, at, known, places) + 2.0 * here.handle
            at, begin, hand, done = goal, n + target, -1, done | 1 << target
            continue
        place = here.containers[target]
        cost += here.metres[at, place] + here.look
        at, begin = place, target
        searched[target] = True
        for k in range(wants):
            if here.number[k, target] >= 0:
                subset[k] |= 1 << here.number[k, target]
            if held[k, target]:
                places[k, known[k]] = place
                known[k] += 1
    return cost + FAILURE_COST


@kernel(inline="always")
def _known_instance_cost(here: DeliveryState, want: int, at: int, known: Ints, places: Ints) -> float:
    """Distance in metres through the best known instance to the want's target."""
    best = np.inf
    for i in range(known[want]):
        via = places[want, i]
        best = min(best, here.metres[at, via] + here.metres[via, here.targets[want]])
    return best


@kernel(inline="always")
def _fill_legs(
    legs: Floats,
    here: DeliveryState,
    at: int,
    begin: int,
    done: int,
    known: Ints,
    places: Ints,
    subset: Ints,
    finds: Floats,
    is_known: Bools,
) -> None:
    """Fill `legs`: the cost of delivering each want from the robot's location (row 0) and from each remaining
    target.

    Args:
        begin: index of the robot's location in `finds`.
    """
    wants, n = len(here.targets), len(here.containers)
    for row in range(wants + 1):
        if row > 0 and done >> (row - 1) & 1:
            continue
        start = at if row == 0 else here.targets[row - 1]
        for k in range(wants):
            if done >> k & 1:
                continue
            if known[k] > 0:
                legs[row, k] = _known_instance_cost(here, k, start, known, places) + 2.0 * here.handle
            elif here.sought[k]:
                place = begin if row == 0 else n + row - 1
                if not is_known[place, k, subset[k]]:
                    is_known[place, k, subset[k]] = True
                    finds[place, k, subset[k]] = _find_cost(here, k, start, subset[k])[0]
                legs[row, k] = finds[place, k, subset[k]] + here.handle
            else:
                legs[row, k] = np.inf


@kernel()
def _find_cost(here: DeliveryState, want: int, start: int, subset: int) -> tuple[float, int]:
    """The cost by Eq. 1 of finding a want after a subset of its candidates has been searched, and the first look."""
    r, c = here.missing[want, subset], here.candidates.shape[1]
    best, look = np.inf, -1
    for j in range(c):
        if not subset >> j & 1:
            best = min(best, _beginning_with(here, want, start, subset, j))
    for j in range(c):
        if not subset >> j & 1 and _beginning_with(here, want, start, subset, j) <= best + _slack(best):
            look = here.candidates[want, j]
            break
    if look < 0 or r < MIN_REMAINING_PROBABILITY:
        return here.beyond[want], look
    return best / r, look


@kernel(inline="always")
def _beginning_with(here: DeliveryState, want: int, start: int, subset: int, j: int) -> float:
    """Eq. 1's cost of a find that looks into candidate j first, weighted by the chance that it comes to that."""
    r, after = here.missing[want, subset], subset | 1 << j
    place = here.containers[here.candidates[want, j]]
    found = here.handle + here.metres[place, here.targets[want]]
    ahead = r * (here.metres[start, place] + here.look) + (r - here.missing[want, after]) * found
    return ahead + here.onward[want, after, j]


@kernel(inline="always")
def _slack(cost: float) -> float:
    """By how much an equal cost may be above the least: ties.tolerance."""
    return RELATIVE * max(MIN_SCALE, abs(cost))


@kernel(inline="always")
def _first_want_of_best_order(legs: Floats, rest: Floats, alternatives: Ints, done: int) -> int:
    """The first want of the cheapest order of the remaining wants, over all ways of meeting the goal, or -1."""
    wants = legs.shape[1]
    for mask in range(1, 1 << wants):
        if mask & done:
            continue
        for last in range(wants):
            if (mask | done) >> last & 1:
                continue
            best = np.inf
            for k in range(wants):
                if mask >> k & 1:
                    best = min(best, legs[last + 1, k] + rest[mask ^ 1 << k, k + 1])
            rest[mask, last + 1] = best
    best = np.inf
    for alternative in alternatives:
        left = alternative & ~done
        for k in range(wants):
            if left >> k & 1:
                best = min(best, legs[0, k] + rest[left ^ 1 << k, k + 1])
    if best == np.inf:
        return -1
    for alternative in alternatives:
        left = alternative & ~done
        for k in range(wants):
            if left >> k & 1 and legs[0, k] + rest[left ^ 1 << k, k + 1] <= best + _slack(best):
                return k
    return -1


@kernel(inline="always")
def _next_look(here: DeliveryState, want: int, at: int, subset: int, searched: Bools) -> int:
    """The next candidate by Eq. 1; after the candidates, the container with the largest ratio of probability to
    distance; -1 for none."""
    look = _find_cost(here, want, at, subset)[1]
    if look >= 0:
        return look
    best = -1.0
    for a in range(len(searched)):
        if not searched[a]:
            best = max(best, _worth(here, want, at, a))
    for a in range(len(searched)):
        if not searched[a] and _worth(here, want, at, a) >= best * (1.0 - RELATIVE):
            return a
    return -1


@kernel(inline="always")
def _worth(here: DeliveryState, want: int, at: int, a: int) -> float:
    """The chance of a container against the distance there and on to the target."""
    place = here.containers[a]
    detour = 1.0 + here.metres[at, place] + here.metres[place, here.targets[want]] / 2.0
    return (here.chance[want, a] + NO_CHANCE) / detour
