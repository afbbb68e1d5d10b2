"""Lower bounds on what a state of the recipe search still costs, and the errand costs that they are made of;
compiled with numba.

The heuristic is admissible: one hand carries one item at a time, so the least carrying costs of all slots add up,
and the slots of a pending operation must meet at one place, the best of which is charged. Walking with empty hands
is charged by potentials: an errand starts where the previous one ended, so adding pot(start) - pot(end) to the cost
of each changes the sum by pot(robot) - pot(last end) only. If pot is the distance to a place to which many items
must go, the least reduced cost of an errand that ends there is its whole round trip. The largest bound over several
potentials is taken, the zero potential included.
"""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

import numpy as np

from workbench.planning.builtin.search_state import compiled

_INF = np.inf


@compiled
def errand_costs(at, find, tables, d, potential, c):
    """Errand costs of each slot; see RecipeArrays for the arrays returned.

    Args:
        at: location indices of each slot's known instances, padded with -1, shape (slots, instances).
        find: table indices of its missing instances, padded with -1, same shape.
        tables: find costs, shape (tables, places, places).
        d, potential, c: as in RecipeArrays.

    Returns:
        fetch, least and standing.
    """
    slots, n = len(at), len(d)
    fetch = np.full((slots, n, n), _INF)
    least = np.full((len(potential), slots, n), _INF)
    standing = np.zeros((slots, n), dtype=np.int64)
    for s in range(slots):
        for j in range(at.shape[1]):
            k = at[s, j]
            if k >= 0:
                standing[s, k] = 1
            if k < 0 and find[s, j] < 0:
                continue
            for a in range(n):
                for b in range(n):
                    w = d[a, k] + c + d[k, b] if k >= 0 else tables[find[s, j], a, b]
                    fetch[s, a, b] = min(fetch[s, a, b], w)
        for p in range(len(potential)):
            for a in range(n):
                for b in range(n):
                    least[p, s, b] = min(least[p, s, b], fetch[s, a, b] + potential[p, a] - potential[p, b])
    return fetch, least, standing


@compiled
def heuristic(recipe, op_mask, state, work):
    """The largest lower bound over all potentials.

    Args:
        op_mask: as in Roles.
        work: scratch array, shape (operations, places).
    """
    best = 0.0
    for k in range(recipe.potential.shape[0]):
        best = max(best, _bound(recipe, op_mask, k, state, work))
    return best


@compiled
def _min_carry_cost(s, m, state, d, least, potential, c):
    """The least reduced cost of bringing slot s to place m, including the pick."""
    if state.hand == s:
        return d[state.robot, m] + potential[state.robot] - potential[m]
    if state.pos[s] >= 0:
        return potential[state.pos[s]] + c + d[state.pos[s], m] - potential[m]
    return least[s, m]


@compiled
def _bound(recipe, op_mask, k, state, work):
    """The lower bound by potential k."""
    d, c = recipe.d, recipe.c
    least, potential = recipe.least[k], recipe.potential[k]
    standing, end, in_hand, link = recipe.standing, recipe.end, recipe.in_hand, recipe.link
    hand, pos, done = state.hand, state.pos, state.done
    total = 0.0
    for s in range(len(pos)):
        t = end[s]
        if op_mask[s] & ~done:
            continue
        if t < 0:
            # A held item that is no longer needed must be put down before anything that needs a free hand.
            if hand == s and _needs_free_hand(recipe, done):
                total += c
        elif hand == s or in_hand[s] or (pos[s] != t and (pos[s] >= 0 or not standing[s, t])):
            total += _min_carry_cost(s, t, state, d, least, potential, c) + (0.0 if in_hand[s] else c)
    for o in range(recipe.n_ops - 1, -1, -1):
        if (done >> o) & 1:
            continue
        least_here = _meeting_bounds(recipe, op_mask, k, o, state, work)
        total += c
        if link[o, 0] < 0 or (done >> link[o, 0]) & 1:
            total += least_here
    return total - potential[state.robot]


@compiled
def _needs_free_hand(recipe, done):
    for o in range(recipe.n_ops):
        if not (done >> o) & 1:
            free = True
            for j in range(recipe.op_slot.shape[1]):
                if recipe.op_slot[o, j] >= 0 and recipe.op_where[o, j] == 1:
                    free = False
            if free:
                return True
    return False


@compiled
def _meeting_bounds(recipe, op_mask, k, o, state, work):
    """Lower bounds on doing an operation, and those linked to it, at each place: fills work[o] and returns its
    minimum.

    This counts bringing its slots together and carrying them onward, without slots counted by earlier operations. A
    slot that stands at two linked operations must be carried from one to the other, unless both are done at one
    place.
    """
    d, c, potential, link = recipe.d, recipe.c, recipe.potential[k], recipe.link
    after = link[o, 1]
    anywhere = _INF
    if after >= 0:
        for m in range(d.shape[0]):
            anywhere = min(anywhere, work[after, m])
    best = _INF
    for m in range(d.shape[0]):
        here = _gathering_cost(recipe, op_mask, k, o, m, state)
        if after >= 0:
            onward = work[after, m]
            if onward > anywhere + 2.0 * c:
                for p in range(d.shape[0]):
                    carried = 2.0 * c + potential[m] + d[m, p] - potential[p] + work[after, p]
                    onward = min(onward, carried)
            here += onward
        work[o, m] = here
        best = min(best, here)
    return best


@compiled
def _gathering_cost(recipe, op_mask, k, o, m, state):
    """The least cost of bringing the slots of operation o to place m, and from there to their final places."""
    d, c, link = recipe.d, recipe.c, recipe.link
    least, potential = recipe.least[k], recipe.potential[k]
    op_slot, op_where, end, in_hand = recipe.op_slot, recipe.op_where, recipe.end, recipe.in_hand
    hand, pos = state.hand, state.pos
    earlier = ~state.done & ((1 << o) - 1)
    here = link[o, 3] * c
    for j in range(op_slot.shape[1]):
        s = op_slot[o, j]
        if s < 0:
            continue
        first = (op_mask[s] & earlier) == 0
        linked = link[o, 0] >= 0 and link[link[o, 0], 2] == s
        if not first and not linked:
            continue
        put = 0.0 if in_hand[s] else c
        t = end[s] if link[o, 1] < 0 or link[o, 2] != s else -1
        if op_where[o, j] == 1:
            here += _min_carry_cost(s, m, state, d, least, potential, c)
            if t >= 0:
                here += potential[m] + d[m, t] - potential[t] + put
            continue
        if first and (hand == s or (pos[s] >= 0 and pos[s] != m) or (pos[s] < 0 and not recipe.standing[s, m])):
            here += _min_carry_cost(s, m, state, d, least, potential, c) + c
        if t >= 0 and (t != m or in_hand[s]):
            here += potential[m] + c + d[m, t] - potential[t] + put
    return here
