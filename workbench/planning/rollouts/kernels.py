"""Rollouts: the cost of each candidate first step, followed by a simple policy, in sampled worlds; compiled with
numba.

A world states for every wanted type which unsearched containers hold it. It is sampled from the belief: a missing
type that exists has at least one instance, a known type any number. The continuation policy replans after every
look, as ConditionedLIOS does: legs of known items cost their distance, legs of missing items cost Eq. 1 over the
candidates not yet searched; the cheapest order of deliveries is chosen, and its first leg is walked, or the first
look of its search is taken. All first steps are tried in the same worlds, so that costs can be compared pairwise.

Worlds that have shown the same so far are in the same state, so the policy decides once for all of them: the moves
after a first step are followed depth first, and each look divides the worlds by what it shows in them.

Numba counts the references to each array that it takes out of a named tuple. That took three quarters of the time, so
the functions below `fill_costs`, which make no arrays, are compiled without it.

Import this module lazily: importing numba takes most of a second.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np

from workbench.arrays import Bools, Floats, Ints, Uints8
from workbench.planning.rollouts.delivery_state import DeliveryState, Scratch
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, NO_CHANCE, RELATIVE

MET, STUCK = -1, -2
"""In place of a move: the goal is met; the policy can do nothing more."""

FAILURE_COST = 1e4
"""Cost of a world in which the policy cannot complete the delivery."""

MIN_REMAINING_PROBABILITY = 1e-9
"""A find with no more than this chance of coming to a next candidate has none left."""

NONE = -1
"""In place of a candidate: there is none."""

SLOTS_BITS = 12
SLOTS = 1 << SLOTS_BITS
"""Of the cache of finds, of which a decision takes a few hundred. One in the slot of another displaces it."""
SPREAD = np.int64(-7046029254386353131)
"""A factor that spreads keys over the slots (Fibonacci hashing)."""

MOVE, AT, HAND, DONE, BEGIN, END, SHOWN = range(7)
"""Columns of Scratch.path: a move; the robot's location, the item in hand and the wants met after it; where the
worlds that are still to be followed from it begin and end; the wants that it shows in those being followed."""


@kernel()
def rollout_costs(steps: Ints, here: DeliveryState, shows: Uints8) -> Floats:
    """The cost of each first step, continued by the policy, in each world, shape (steps, worlds).

    Args:
        steps: moves (delivery_state.Scratch), shape (steps,).
        shows: bit masks of the wants that a look into each container shows, shape (worlds, n).
    """
    costs, all_steps = np.empty((len(steps), len(shows))), np.ones(len(steps), np.bool_)
    fill_costs(costs[:, :], steps, all_steps, here, shows, scratch(here, len(shows)))
    return costs


@kernel()
def scratch(here: DeliveryState, worlds: int) -> Scratch:
    """Scratch arrays for rollouts from one state in at most so many worlds."""
    wants, n = len(here.targets), len(here.containers)
    finds, candidates = here.candidates.shape
    number = np.full((finds, n), NONE)
    for find in range(finds):
        for j in range(candidates):
            number[find, here.candidates[find, j]] = j
    most = n + wants + 1  # a rollout looks into a container and meets a want at most once
    return Scratch(
        number=number,
        searched=np.zeros(n, np.bool_),
        subset=np.zeros(finds, np.int64),
        known=here.known.copy(),
        places=here.places.copy(),
        legs=np.empty((wants + 1, wants)),
        rest=np.zeros((1 << wants, wants + 1)),
        keys=np.zeros(SLOTS, np.int64),
        finds=np.empty(SLOTS),
        first=np.empty(SLOTS, np.int8),
        look=np.empty(wants, np.int64),
        ahead=np.empty(candidates),
        worlds=np.empty(worlds, np.int64),
        path=np.empty((most, SHOWN + 1), np.int64),
        spent=np.empty(most),
    )


@kernel()
def fill_costs(costs: Floats, steps: Ints, wanted: Bools, here: DeliveryState, shows: Uints8, room: Scratch) -> None:
    """Fill `costs`, shape (steps, worlds): of each step that is wanted, in each world; others as rollout_costs."""
    for step in range(len(steps)):
        if wanted[step]:
            for world in range(len(shows)):
                room.worlds[world] = world
            _follow(costs[step], steps[step], here, shows, room)


@kernel(borrows=True)
def _follow(answer: Floats, first_step: int, here: DeliveryState, shows: Uints8, room: Scratch) -> None:
    """Fill `answer`: the cost of a first step and of what the policy does after it, in each world."""
    known, places, worlds, path, spent = room.known, room.places, room.worlds, room.path, room.spent
    searched, subset, number = room.searched, room.subset, room.number
    metres, containers, targets = here.metres, here.containers, here.targets
    n, level = len(containers), -1
    at, hand, done, begin, end, move, cost = here.robot, here.hand, here.done, 0, len(shows), first_step, 0.0
    while True:
        if move >= 0:
            level += 1
            path[level, MOVE], path[level, BEGIN], path[level, END] = move, begin, end
            if move < n:
                cost += metres[at, containers[move]] + here.look
                at = containers[move]
                _note_search(move, searched, subset, number)
            else:
                want = move - n
                if hand == want:
                    cost += metres[at, targets[want]] + here.handle
                else:
                    cost += _known_instance_cost(here, want, at, known, places) + 2.0 * here.handle
                at, hand, done = targets[want], -1, done | 1 << want
            path[level, AT], path[level, HAND], path[level, DONE], spent[level] = at, hand, done, cost
        else:
            for i in range(begin, end):
                answer[worlds[i]] = cost + FAILURE_COST if move == STUCK else cost
            _forget(path[level, SHOWN], known)
            while path[level, BEGIN] == path[level, END]:
                if path[level, MOVE] < n:
                    _take_back_search(path[level, MOVE], searched, subset, number)
                level -= 1
                if level < 0:
                    return
                _forget(path[level, SHOWN], known)
            at, hand, done, cost = path[level, AT], path[level, HAND], path[level, DONE], spent[level]
        last_move, begin, end = path[level, MOVE], path[level, BEGIN], path[level, END]
        shown = 0
        if last_move < n:
            shown, same = int(shows[worlds[begin], last_move]), begin + 1
            for i in range(begin + 1, end):
                if shows[worlds[i], last_move] == shown:
                    worlds[i], worlds[same] = worlds[same], worlds[i]
                    same += 1
            end = same
            for k in range(len(known)):
                if shown >> k & 1:
                    places[k, known[k]] = at
                    known[k] += 1
        path[level, BEGIN], path[level, SHOWN] = end, shown
        move = _next_move(here, room, at, last_move, hand, done)


@kernel(inline="always", borrows=True)
def _note_search(container: int, searched: Bools, subset: Ints, number: Ints) -> None:
    searched[container] = True
    for find in range(len(subset)):
        if number[find, container] >= 0:
            subset[find] |= 1 << number[find, container]


@kernel(inline="always", borrows=True)
def _take_back_search(container: int, searched: Bools, subset: Ints, number: Ints) -> None:
    searched[container] = False
    for find in range(len(subset)):
        if number[find, container] >= 0:
            subset[find] &= ~(1 << number[find, container])


@kernel(inline="always", borrows=True)
def _forget(shown: int, known: Ints) -> None:
    """Undo that a look has shown these wants."""
    for k in range(len(known)):
        if shown >> k & 1:
            known[k] -= 1


@kernel(forceinline=True, borrows=True)
def _next_move(here: DeliveryState, room: Scratch, at: int, last_move: int, hand: int, done: int) -> int:
    """The policy's move from a location, where its last move has led; MET or STUCK."""
    n = len(here.containers)
    for alternative in here.alternatives:
        if alternative & ~done == 0:
            return MET
    if hand >= 0:
        return n + hand
    _fill_legs(here, room, at, last_move, done)
    want = _first_want_of_best_order(room.legs, room.rest, here.alternatives, done)
    if want < 0:
        return STUCK
    if room.known[want] > 0:
        return n + want
    return _next_look(here, want, at, int(room.look[want]), room.searched)


@kernel(inline="always", borrows=True)
def _known_instance_cost(here: DeliveryState, want: int, at: int, known: Ints, places: Ints) -> float:
    """Distance in metres through the best known instance to the want's target."""
    best = np.inf
    for i in range(known[want]):
        via = places[want, i]
        best = min(best, here.metres[at, via] + here.metres[via, here.targets[want]])
    return best


@kernel(inline="always", borrows=True)
def _fill_legs(here: DeliveryState, room: Scratch, at: int, last_move: int, done: int) -> None:
    """Fill `legs`: the cost of delivering each want from the robot's location (row 0) and from the other remaining
    targets."""
    legs, known = room.legs, room.known
    wants, n = len(here.targets), len(here.containers)
    for row in range(wants + 1):
        if row > 0 and done >> (row - 1) & 1:
            continue
        start, origin = (at, last_move) if row == 0 else (here.targets[row - 1], n + row - 1)
        for k in range(wants):
            find = here.find[k]
            if done >> k & 1 or row == k + 1:
                continue
            if known[k] > 0:
                legs[row, k] = _known_instance_cost(here, k, start, known, room.places) + 2.0 * here.handle
            elif find >= 0:
                subset = int(room.subset[find])
                key = ((origin * len(room.subset) + find) * here.missing.shape[1] + subset) + 1
                slot = (key * SPREAD >> 64 - SLOTS_BITS) & SLOTS - 1
                if room.keys[slot] != key:
                    room.keys[slot] = key
                    room.finds[slot], room.first[slot] = _find_cost(here, k, start, subset, room.ahead)
                legs[row, k] = room.finds[slot] + here.handle
                if row == 0:
                    room.look[k] = room.first[slot]
            else:
                legs[row, k] = np.inf


@kernel(forceinline=True, borrows=True)
def _find_cost(here: DeliveryState, want: int, start: int, subset: int, ahead: Floats) -> tuple[float, int]:
    """The cost by Eq. 1 of finding a want after a subset of its candidates has been searched, and the candidate that
    is looked into first."""
    find = here.find[want]
    r, best, first = float(here.missing[find, subset]), np.inf, NONE
    for j in range(len(ahead)):
        if not subset >> j & 1:
            after, place = subset | 1 << j, here.containers[here.candidates[find, j]]
            found = here.handle + here.metres[place, here.targets[want]]
            there = r * (here.metres[start, place] + here.look) + (r - here.missing[find, after]) * found
            ahead[j] = there + here.onward[find, after, j]
            best = min(best, ahead[j])
    for j in range(len(ahead)):
        if not subset >> j & 1 and ahead[j] <= best + slack(best):
            first = j
            break
    if first == NONE or r < MIN_REMAINING_PROBABILITY:
        return float(here.beyond[find]), first
    return best / r, first


@kernel(inline="always", borrows=True)
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
            if left >> k & 1 and legs[0, k] + rest[left ^ 1 << k, k + 1] <= best + slack(best):
                return k
    return -1


@kernel(inline="always", borrows=True)
def slack(cost: float) -> float:
    """By how much an equal cost may be above the least: ties.tolerance."""
    return RELATIVE * max(MIN_SCALE, abs(cost))


@kernel(inline="always", borrows=True)
def _next_look(here: DeliveryState, want: int, at: int, first: int, searched: Bools) -> int:
    """The first candidate by Eq. 1; after the candidates, the container with the largest ratio of probability to
    distance; STUCK for none."""
    if first != NONE:
        return here.candidates[here.find[want], first]
    best = -1.0
    for a in range(len(searched)):
        if not searched[a]:
            best = max(best, _worth(here, want, at, a))
    for a in range(len(searched)):
        if not searched[a] and _worth(here, want, at, a) >= best * (1.0 - RELATIVE):
            return a
    return STUCK


@kernel(inline="always", borrows=True)
def _worth(here: DeliveryState, want: int, at: int, a: int) -> float:
    """The chance of a container against the distance there and on to the target."""
    place = here.containers[a]
    detour = 1.0 + here.metres[at, place] + here.metres[place, here.targets[want]] / 2.0
    return (here.chance[want, a] + NO_CHANCE) / detour
