"""Lower bounds on the cost from a state of the recipe search on, and the errand costs that they rest on; compiled.

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

from workbench.planning.builtin.search_queue import INF, compiled


@compiled
def errand_costs(at, find, tables, d, potential, c):
    """Errand costs of each slot; fetch, least and standing of RecipeArrays.

    Args:
        at: location indices of each slot's known instances, padded with -1, shape (slots, instances).
        find: table indices of its missing instances, padded with -1, same shape.
        tables: find costs, shape (tables, places, places).
        d, potential, c: as in RecipeArrays.

    Returns:
        fetch, least and standing.
    """
    slots, n = len(at), len(d)
    fetch = np.full((slots, n, n), INF)
    least = np.full((len(potential), slots, n), INF)
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
def heuristic(
    robot, hand, pos, done, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask, link, n_ops, c,
    work,
):  # fmt: skip
    """The largest lower bound over all potentials; astar.py says why it takes no named tuple."""
    best = 0.0
    for k in range(potential.shape[0]):
        bound = _bound(
            robot, hand, pos, done, d, least[k], potential[k], standing, end, in_hand, op_slot, op_where, op_mask,
            link, n_ops, c, work,
        )  # fmt: skip
        best = max(best, bound)
    return best


@compiled
def _min_carry_cost(s, m, robot, hand, pos, d, least, potential, c):
    """The least reduced cost of bringing slot s to place m, including the pick."""
    if hand == s:
        return d[robot, m] + potential[robot] - potential[m]
    if pos[s] >= 0:
        return potential[pos[s]] + c + d[pos[s], m] - potential[m]
    return least[s, m]


@compiled
def _bound(
    robot, hand, pos, done, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask, link, n_ops, c,
    work,
):  # fmt: skip
    total = 0.0
    for s in range(len(pos)):
        t = end[s]
        if op_mask[s] & ~done:
            continue
        if t < 0:
            # A held item that is no longer needed must be put down before anything that needs a free hand.
            if hand == s and _needs_free_hand(done, op_slot, op_where, n_ops):
                total += c
        elif hand == s or in_hand[s] or (pos[s] != t and (pos[s] >= 0 or not standing[s, t])):
            total += _min_carry_cost(s, t, robot, hand, pos, d, least, potential, c) + (0.0 if in_hand[s] else c)
    for o in range(n_ops - 1, -1, -1):
        if (done >> o) & 1:
            continue
        least_here = _meeting_bounds(
            o, robot, hand, pos, done, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask, link,
            c, work,
        )  # fmt: skip
        total += c
        if link[o, 0] < 0 or (done >> link[o, 0]) & 1:
            total += least_here
    return total - potential[robot]


@compiled
def _needs_free_hand(done, op_slot, op_where, n_ops):
    for o in range(n_ops):
        if not (done >> o) & 1:
            free = True
            for j in range(op_slot.shape[1]):
                if op_slot[o, j] >= 0 and op_where[o, j] == 1:
                    free = False
            if free:
                return True
    return False


@compiled
def _meeting_bounds(
    o, robot, hand, pos, done, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask, link, c, work
):  # fmt: skip
    """Lower bounds on doing an operation, and those linked to it, at each place: fills work[o] and returns its
    minimum.

    This counts bringing its slots together and carrying them onward, without slots counted by earlier operations. A
    slot that stands at two linked operations must be carried from one to the other, unless both are done at one
    place.
    """
    nothing = (1 << o) - 1
    after = link[o, 1]
    best = INF
    if after >= 0:
        for m in range(d.shape[0]):
            best = min(best, work[after, m])
    anywhere, best = best, INF
    for m in range(d.shape[0]):
        here = link[o, 3] * c
        for j in range(op_slot.shape[1]):
            s = op_slot[o, j]
            if s < 0:
                continue
            first = (op_mask[s] & ~done & nothing) == 0
            linked = link[o, 0] >= 0 and link[link[o, 0], 2] == s
            if not first and not linked:
                continue
            put = 0.0 if in_hand[s] else c
            t = end[s] if after < 0 or link[o, 2] != s else -1
            if op_where[o, j] == 1:
                here += _min_carry_cost(s, m, robot, hand, pos, d, least, potential, c)
                if t >= 0:
                    here += potential[m] + d[m, t] - potential[t] + put
                continue
            if first and (hand == s or (pos[s] >= 0 and pos[s] != m) or (pos[s] < 0 and not standing[s, m])):
                here += _min_carry_cost(s, m, robot, hand, pos, d, least, potential, c) + c
            if t >= 0 and (t != m or in_hand[s]):
                here += potential[m] + c + d[m, t] - potential[t] + put
        if after >= 0:
            onward = work[after, m]
            if onward > anywhere + 2.0 * c:
                for k in range(d.shape[0]):
                    carried = 2.0 * c + potential[m] + d[m, k] - potential[k] + work[after, k]
                    onward = min(onward, carried)
            here += onward
        work[o, m] = here
        best = min(best, here)
    return best
