"""Rollouts: the cost of each candidate first step, followed by a simple policy, in sampled worlds; compiled with
numba.

A world states for every wanted type which unsearched containers hold it. It is sampled from the belief: a missing
type that exists has at least one instance, a known type any number. The continuation policy replans after every
look, as ConditionedLIOS does: legs of known items cost their distance, legs of missing items cost Eq. 1 over the
candidates not yet searched; the cheapest order of deliveries is chosen, and its first leg is walked, or the first
look of its search is taken. All first steps are tried in the same worlds, so that costs can be compared pairwise.

Worlds that have shown the same so far are in the same state, so the policy decides once for all of them: after each
first step its moves form a tree, in which what a look shows leads on. Five of six moves are found there.

Numba counts the references to each array that it takes out of a named tuple. That took half of the time, so the loop
over the worlds takes them out once for all.

Import this module lazily: importing numba takes most of a second.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.arrays import Bools, Floats, Ints, Ints8
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, NO_CHANCE, RELATIVE

FETCH, LOOK = 0, 1
"""Kinds of first steps: fetch (or go on carrying) a wanted item and deliver it; look into a container."""

MET, STUCK = -1, -2
"""In place of a move: the goal is met; the policy can do nothing more."""

FAILURE_COST = 1e4
"""Cost of a world in which the policy cannot complete the delivery."""

MIN_REMAINING_PROBABILITY = 1e-9
"""A find with no more than this chance of coming to a next candidate has none left."""

NONE, UNKNOWN = -1, -2
"""In place of a candidate or node: there is none; it is not computed yet."""


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

    A move is to look into a container (its index, below n), or to fetch a want's item, or to go on carrying it, and
    deliver it (n and the want's index).

    Attributes:
        searched: searched containers, shape (n,); subset: bit mask of each want's searched candidates, shape (K,).
        places, known: as in DeliveryState, plus the instances found since.
        legs: cost of delivering each want from the robot's location (row 0) and from each target, shape (K + 1, K).
        rest: cost of the remaining wants (a mask), by the want delivered last, shape (2**K, K + 1).
        finds: cache of find costs across worlds, by origin (the move that led there), want and subset, shape
            (n + K, K, 2**c); first: of the same finds, the candidate looked into first.
        moves: the move at each node of the tree of one first step; the first node is its root.
        after: the next node by the wants that a move shows (a bit mask), shape (nodes, 2**K).
    """

    searched: Bools
    subset: Ints
    known: Ints
    places: Ints
    legs: Floats
    rest: Floats
    finds: Floats
    first: Ints8
    moves: Ints
    after: Ints


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
    most = 1 + len(held) * (n + wants)  # a rollout looks into a container and meets a want at most once
    room = Scratch(
        searched=np.zeros(n, np.bool_),
        subset=np.zeros(wants, np.int64),
        known=here.known.copy(),
        places=here.places.copy(),
        legs=np.empty((wants + 1, wants)),
        rest=np.zeros((1 << wants, wants + 1)),
        finds=np.empty((n + wants, wants, here.missing.shape[1])),
        first=np.full((n + wants, wants, here.missing.shape[1]), UNKNOWN, np.int8),
        moves=np.empty(most, np.int64),
        after=np.empty((most, 1 << wants), np.int64),
    )
    for step in range(len(kinds)):
        room.moves[0] = targets[step] if kinds[step] == LOOK else n + targets[step]
        _fill_costs(answer[step], here, held, room)
    return answer


@kernel()
def _fill_costs(answer: Floats, here: DeliveryState, held: Bools, room: Scratch) -> None:
    """Fill `answer`: the cost of the first step at the root of the tree in each world."""
    searched, subset, known = room.searched, room.subset, room.known
    places, moves, after = room.places, room.moves, room.after
    metres, containers, targets, number = here.metres, here.containers, here.targets, here.number
    wants, n = len(targets), len(containers)
    after[0] = NONE
    nodes = 1
    for w in range(len(held)):
        for a in range(n):
            searched[a] = False
        for k in range(wants):
            subset[k], known[k] = 0, here.known[k]
        at, hand, done, cost = here.robot, here.hand, here.done, 0.0
        node, move = 0, int(moves[0])
        while move >= 0:
            shown = 0
            if move < n:
                cost += metres[at, containers[move]] + here.look
                at = int(containers[move])
                searched[move] = True
                for k in range(wants):
                    if number[k, move] >= 0:
                        subset[k] |= 1 << number[k, move]
                    if held[w, k, move]:
                        places[k, known[k]] = at
                        known[k] += 1
                        shown |= 1 << k
            else:
                want = move - n
                if hand == want:
                    cost += metres[at, targets[want]] + here.handle
                else:
                    cost += _known_instance_cost(here, want, at, known, places) + 2.0 * here.handle
                at, hand, done = int(targets[want]), -1, done | 1 << want
            if after[node, shown] == NONE:
                after[node, shown] = nodes
                moves[nodes], after[nodes] = _next_move(here, room, at, move, hand, done), NONE
                nodes += 1
            node = after[node, shown]
            move = int(moves[node])
        answer[w] = cost + FAILURE_COST if move == STUCK else cost


@kernel(forceinline=True)
def _next_move(here: DeliveryState, room: Scratch, at: int, last_move: int, hand: int, done: int) -> int:
    """The policy's move from a location, where its last move has led; MET or STUCK."""
    n = len(here.containers)
    for alternative in here.alternatives:
        if alternative & ~done == 0:
            return MET
    if hand >= 0:
        return n + hand
    subset, known, legs, first = room.subset, room.known, room.legs, room.first
    _fill_legs(legs, here, at, last_move, done, known, room.places, subset, room.finds, first)
    want = _first_want_of_best_order(legs, room.rest, here.alternatives, done)
    if want < 0:
        return STUCK
    if known[want] > 0:
        return n + want
    return _next_look(here, want, at, first[last_move, want, subset[want]], room.searched)


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
    last_move: int,
    done: int,
    known: Ints,
    places: Ints,
    subset: Ints,
    finds: Floats,
    first: Ints8,
) -> None:
    """Fill `legs`: the cost of delivering each want from the robot's location (row 0) and from each remaining
    target."""
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
                origin = last_move if row == 0 else n + row - 1
                if first[origin, k, subset[k]] == UNKNOWN:
                    cost, candidate = _find_cost(here, k, start, subset[k])
                    finds[origin, k, subset[k]], first[origin, k, subset[k]] = cost, candidate
                legs[row, k] = finds[origin, k, subset[k]] + here.handle
            else:
                legs[row, k] = np.inf


@kernel(inline="always")
def _find_cost(here: DeliveryState, want: int, start: int, subset: int) -> tuple[float, int]:
    """The cost by Eq. 1 of finding a want after a subset of its candidates has been searched, and the candidate that
    is looked into first."""
    r, c = here.missing[want, subset], here.candidates.shape[1]
    best, first = np.inf, NONE
    for j in range(c):
        if not subset >> j & 1:
            best = min(best, _beginning_with(here, want, start, subset, j))
    for j in range(c):
        if not subset >> j & 1 and _beginning_with(here, want, start, subset, j) <= best + _slack(best):
            first = j
            break
    if first == NONE or r < MIN_REMAINING_PROBABILITY:
        return here.beyond[want], first
    return best / r, first


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
def _next_look(here: DeliveryState, want: int, at: int, first: int, searched: Bools) -> int:
    """The first candidate by Eq. 1; after the candidates, the container with the largest ratio of probability to
    distance; STUCK for none."""
    if first != NONE:
        return here.candidates[want, first]
    best = -1.0
    for a in range(len(searched)):
        if not searched[a]:
            best = max(best, _worth(here, want, at, a))
    for a in range(len(searched)):
        if not searched[a] and _worth(here, want, at, a) >= best * (1.0 - RELATIVE):
            return a
    return STUCK


@kernel(inline="always")
def _worth(here: DeliveryState, want: int, at: int, a: int) -> float:
    """The chance of a container against the distance there and on to the target."""
    place = here.containers[a]
    detour = 1.0 + here.metres[at, place] + here.metres[place, here.targets[want]] / 2.0
    return (here.chance[want, a] + NO_CHANCE) / detour
