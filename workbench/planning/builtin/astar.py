"""Exact A* search for the cheapest way to carry out one recipe, compiled with numba.

A state consists of the robot's location, the held slot, the location of each slot (or that its instance is not
chosen yet) and the set of finished operations. One move of the search is a whole errand: fetch a slot and carry it
somewhere, put it down, carry on, or walk somewhere and prepare. With one hand and metric travel, every optimal plan
is a sequence of errands.

The heuristic is admissible: one hand carries one item at a time, so the least carrying costs of all slots add up,
and the slots of a pending operation must meet at one place, the best of which is charged. Walking with empty hands
is charged by potentials: an errand starts where the previous one ended, so adding pot(start) - pot(end) to the cost
of each changes the sum by pot(robot) - pot(last end) only. If pot is the distance to a place to which many items
must go, the least reduced cost of an errand that ends there is its whole round trip. The largest bound over several
potentials is taken, the zero potential included.
"""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

from typing import Any, cast

import numba
import numpy as np

from workbench.planning.builtin.move_codes import CARRY, CHOOSE, FETCH, LIMIT, NO_PLAN, PLACE, PREPARE, SOLVED
from workbench.tolerances import RELATIVE, SMALLEST_SCALE

_INF = np.inf


def _compiled(function: Any) -> Any:
    return cast(Any, numba.njit(cache=True, nogil=True)(function))


@_compiled
def errand_costs(at, find, tables, d, potential, c):
    """Errand costs of each slot; see `search` for the arrays returned.

    Args:
        at: location indices of each slot's known instances, padded with -1, shape (slots, instances).
        find: table indices of its missing instances, padded with -1, same shape.
        tables: find costs, shape (tables, places, places).
        d, potential, c: as in search.

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


@_compiled
def _heuristic(
    robot, hand, pos, done, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask, link, n_ops, c,
    work,
):  # fmt: skip
    """The largest lower bound over all potentials."""
    best = 0.0
    for k in range(potential.shape[0]):
        bound = _bound(
            robot, hand, pos, done, d, least[k], potential[k], standing, end, in_hand, op_slot, op_where, op_mask,
            link, n_ops, c, work,
        )  # fmt: skip
        best = max(best, bound)
    return best


@_compiled
def _min_carry_cost(s, m, robot, hand, pos, d, least, potential, c):
    """The least reduced cost of bringing slot s to place m, including the pick."""
    if hand == s:
        return d[robot, m] + potential[robot] - potential[m]
    if pos[s] >= 0:
        return potential[pos[s]] + c + d[pos[s], m] - potential[m]
    return least[s, m]


@_compiled
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


@_compiled
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


@_compiled
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
    best = _INF
    if after >= 0:
        for m in range(d.shape[0]):
            best = min(best, work[after, m])
    anywhere, best = best, _INF
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


@_compiled
def _partner_stands(s, b, pos, done, op_slot, op_where, n_ops):
    """Whether the other parts of some operation of the tool in hand stand at b."""
    for o in range(n_ops):
        if (done >> o) & 1:
            continue
        mine = False
        others = True
        for j in range(op_slot.shape[1]):
            if op_slot[o, j] == s:
                mine = True
            elif op_slot[o, j] >= 0 and pos[op_slot[o, j]] != b:
                others = False
        if mine and others:
            return True
    return False


@_compiled
def _slot_of_code(code, table, size):
    h = code * np.int64(-7046029254386353131)
    i = ((h >> 20) ^ h) & (size - 1)
    while table[i, 0] != -1 and table[i, 0] != code:
        i = (i + 1) & (size - 1)
    return i


@_compiled
def _grown_table(table):
    size = table.shape[0] * 2
    bigger = np.full((size, 2), -1, dtype=np.int64)
    for i in range(table.shape[0]):
        if table[i, 0] != -1:
            j = _slot_of_code(table[i, 0], bigger, size)
            bigger[j, 0] = table[i, 0]
            bigger[j, 1] = table[i, 1]
    return bigger


@_compiled
def _before(f, n, other_f, other_n, eps):
    """Whether a state is looked at before another: it costs less, or the same (ties.py) and is younger."""
    return f < other_f - eps or (f <= other_f + eps and n > other_n)


@_compiled
def _push(heap_f, heap_n, count, f, n, eps):
    i = count
    while i > 0:
        p = (i - 1) >> 1
        if _before(heap_f[p], heap_n[p], f, n, eps):
            break
        heap_f[i] = heap_f[p]
        heap_n[i] = heap_n[p]
        i = p
    heap_f[i] = f
    heap_n[i] = n


@_compiled
def _pop(heap_f, heap_n, count, eps):
    """Remove the top of the heap; the caller has read it and decrements the count."""
    last = count - 1
    f = heap_f[last]
    n = heap_n[last]
    i = 0
    while True:
        k = 2 * i + 1
        if k >= last:
            break
        if k + 1 < last and _before(heap_f[k + 1], heap_n[k + 1], heap_f[k], heap_n[k], eps):
            k += 1
        if _before(f, n, heap_f[k], heap_n[k], eps):
            break
        heap_f[i] = heap_f[k]
        heap_n[i] = heap_n[k]
        i = k
    heap_f[i] = f
    heap_n[i] = n


@_compiled
def _operation_place(o, robot, hand, pos, done, op_slot, op_where, op_after):
    """The place where an operation can be done with the items there and the item in hand, or -1."""
    if (done >> o) & 1 or (op_after[o] & ~done) != 0:
        return -1
    where = -1
    needs_hand = False
    for j in range(op_slot.shape[1]):
        s = op_slot[o, j]
        if s < 0:
            continue
        if op_where[o, j] == 1:
            needs_hand = True
            if hand != s:
                return -1
        elif hand == s or pos[s] < 0 or (where >= 0 and pos[s] != where):
            return -1
        else:
            where = pos[s]
    if needs_hand:
        return robot if where < 0 or where == robot else -1
    return -1 if hand >= 0 else (robot if where < 0 else where)


@_compiled
def _append_move(succ, cost, n, kind, x, b, w):
    succ[n, 0] = kind
    succ[n, 1] = x
    succ[n, 2] = b
    cost[n] = w
    return n + 1


@_compiled
def _moves(
    robot, hand, pos, done, at_root, last, first, staging, d, fetch, standing, end, in_hand, op_slot, op_where,
    op_after, op_mask, carried_only, tool, n_ops, c, succ, cost,
):  # fmt: skip
    """Write the moves from a state to succ and cost, and return their number.

    A move that needs no walking and belongs to every plan from here is the only one returned: an operation whose
    items are all here, or putting down an item that belongs here.
    """
    if first < 0:
        for o in range(n_ops):
            if _operation_place(o, robot, hand, pos, done, op_slot, op_where, op_after) == robot:
                return _append_move(succ, cost, 0, PREPARE, o, robot, c)
        if hand >= 0 and end[hand] == robot and not in_hand[hand] and (op_mask[hand] & ~done) == 0:
            return _append_move(succ, cost, 0, PLACE, hand, robot, c)
    n = 0
    for s in range(len(pos)):
        pending = (op_mask[s] & ~done) != 0
        if first < 0 and pos[s] < 0 and hand != s:
            # Choosing an instance that stands in place already costs nothing.
            for a in range(d.shape[0]):
                here = standing[s, a] and (pending or (end[s] == a and not in_hand[s]))
                if here and (not carried_only[s] or a == end[s]):
                    n = _append_move(succ, cost, n, CHOOSE, s, a, 0.0)
        if hand >= 0 or (first >= 0 and s != first):
            continue
        if not pending and (end[s] < 0 or (pos[s] == end[s] and not in_hand[s])):
            continue
        for b in range(d.shape[0]):
            if not staging and b != end[s]:
                if not pending:
                    continue
                if tool[s] and not _partner_stands(s, b, pos, done, op_slot, op_where, n_ops):
                    continue
            w = fetch[s, robot, b] if pos[s] < 0 else d[robot, pos[s]] + c + d[pos[s], b]
            if w < _INF and (pos[s] != b or tool[s] or in_hand[s]):
                n = _append_move(succ, cost, n, FETCH, s, b, w)
    if hand >= 0 and (first < 0 or hand == first):
        pending = (op_mask[hand] & ~done) != 0
        useful = staging or not carried_only[hand] or robot == end[hand]
        if useful and (staging or not in_hand[hand] or pending):
            n = _append_move(succ, cost, n, PLACE, hand, robot, c)
        if (last != FETCH and last != CARRY) or at_root:
            for b in range(d.shape[0]):
                if b != robot and (staging or pending or b == end[hand]):
                    n = _append_move(succ, cost, n, CARRY, hand, b, d[robot, b])
    if first < 0:
        for o in range(n_ops):
            where = _operation_place(o, robot, hand, pos, done, op_slot, op_where, op_after)
            if where >= 0:
                n = _append_move(succ, cost, n, PREPARE, o, where, c + d[robot, where])
    return n


@_compiled
def search(
    robot0, hand0, g0, first, d, fetch, least, potential, standing, end, in_hand, op_slot, op_where, op_after, link,
    n_ops, c, staging, weight, bound, most_nodes,
):  # fmt: skip
    """A* search from one state.

    Args:
        robot0, hand0: the robot's location; the slot in its hand, or -1.
        g0: cost incurred before the first move.
        first: slot that must be fetched (or carried) first, or -1.
        d: distances in metres, shape (places, places).
        fetch: cost of walking to a slot's nearest instance, picking it and carrying it on; shape
            (slots, places, places); infinite without an instance.
        least: minimum of the reduced fetch cost over its origins, shape (potentials, slots, places).
        potential: shape (potentials, places); see the module docstring.
        standing: whether an instance stands there already, shape (slots, places).
        end, in_hand: end: required final place of each slot, -1 for any; in_hand: whether it must be held there.
        op_slot, op_where: slots of each operation, -1 for none, and 1 for those in hand; shape (operations, parts).
        op_after: bit mask of operations that come before; they have smaller numbers.
        link: of each operation the one before and the one after at which the same slot stands, -1 for none,
            that slot
            (of the one after), and 1 if a tool must be put down before another operation; shape (operations, 4).
        c: cost of a manipulation.
        staging: whether items may be put down at intermediate places where they are not used.
        weight: weight of the heuristic; 1 gives the optimum, larger weights find a plan sooner.
        bound: only plans cheaper than this are sought.
        most_nodes: node limit.

    Returns:
        (status, cost, lower bound, moves), moves of shape (n, 3) in reverse order, expanded nodes.
    """
    n_slots = fetch.shape[0]
    n_loc = d.shape[0]
    carried_only = np.ones(n_slots, dtype=np.bool_)
    op_mask = np.zeros(n_slots, dtype=np.int64)
    for o in range(n_ops):
        for j in range(op_slot.shape[1]):
            if op_slot[o, j] >= 0:
                carried_only[op_slot[o, j]] = False
                op_mask[op_slot[o, j]] |= 1 << o
    base = np.empty(n_slots, dtype=np.int64)
    for s in range(n_slots):
        base[s] = 2 if carried_only[s] and not staging else n_loc + 1
    tool = np.zeros(n_slots, dtype=np.bool_)
    for s in range(n_slots):
        tool[s] = not carried_only[s]
        for o in range(n_ops):
            for j in range(op_slot.shape[1]):
                if op_slot[o, j] == s and op_where[o, j] == 0:
                    tool[s] = False
    all_done = (1 << n_ops) - 1
    capacity = 64
    node_pos = np.full((capacity, n_slots), -1, dtype=np.int64)
    node = np.zeros((capacity, 3), dtype=np.int64)  # robot, hand, done
    node_g = np.zeros(capacity)
    parent = np.full(capacity, -1, dtype=np.int64)
    action = np.zeros((capacity, 3), dtype=np.int64)
    heap_f = np.zeros(capacity)
    heap_n = np.zeros(capacity, dtype=np.int64)
    table = np.full((256, 2), -1, dtype=np.int64)
    count = 1
    heap = 0
    node[0, 0] = robot0
    node[0, 1] = hand0
    node_g[0] = g0
    work = np.zeros((max(n_ops, 1), n_loc))
    h0 = _heuristic(
        robot0, hand0, node_pos[0], 0, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask, link,
        n_ops, c, work,
    )  # fmt: skip
    empty = np.zeros((0, 3), dtype=np.int64)
    eps = RELATIVE * max(SMALLEST_SCALE, g0 + h0)
    if g0 + h0 >= bound - eps:
        return NO_PLAN, _INF, g0 + h0, empty, 0
    _push(heap_f, heap_n, heap, g0 + h0, 0, eps)
    heap = 1
    expanded = 0
    pruned = _INF
    succ = np.zeros((n_slots * (2 * n_loc + 2) + n_ops * n_loc + n_loc + 4, 3), dtype=np.int64)
    cost = np.zeros(len(succ))
    closed = np.zeros(capacity, dtype=np.bool_)
    pos2 = np.zeros(n_slots, dtype=np.int64)
    while heap > 0:
        f = heap_f[0]
        i = heap_n[0]
        _pop(heap_f, heap_n, heap, eps)
        heap -= 1
        if closed[i]:
            continue
        closed[i] = True
        robot = node[i, 0]
        hand = node[i, 1]
        done = node[i, 2]
        g = node_g[i]
        pos = node_pos[i]
        met = done == all_done
        for s in range(n_slots):
            if met and end[s] >= 0:
                if in_hand[s]:
                    met = hand == s and robot == end[s]
                else:
                    met = hand != s and pos[s] == end[s]
        if met:
            length = 0
            k = i
            while parent[k] >= 0:
                length += 1
                k = parent[k]
            moves = np.zeros((length, 3), dtype=np.int64)
            k = i
            for q in range(length):
                moves[q] = action[k]
                k = parent[k]
            return SOLVED, g, g if weight == 1.0 else g0 + h0, moves, expanded
        expanded += 1
        if count > most_nodes:
            return LIMIT, _INF, f if weight == 1.0 else g0 + h0, empty, expanded
        n = _moves(
            robot, hand, pos, done, i == 0, action[i, 0], first if i == 0 else -1, staging, d, fetch, standing, end,
            in_hand, op_slot, op_where, op_after, op_mask, carried_only, tool, n_ops, c, succ, cost,
        )  # fmt: skip
        for k in range(n):
            kind = succ[k, 0]
            x = succ[k, 1]
            b = succ[k, 2]
            robot2 = robot
            hand2 = hand
            done2 = done
            for s in range(n_slots):
                pos2[s] = pos[s]
            if kind == FETCH:
                robot2 = b
                hand2 = x
                pos2[x] = -1
            elif kind == PLACE:
                hand2 = -1
                pos2[x] = b
            elif kind == CARRY:
                robot2 = b
            elif kind == PREPARE:
                robot2 = b
                done2 = done | (1 << x)
            else:
                pos2[x] = b
            g2 = g + cost[k]
            code = np.int64(done2)
            code = code * n_loc + robot2
            code = code * (n_slots + 1) + hand2 + 1
            for s in range(n_slots):
                digit = np.int64(0)
                if pos2[s] >= 0:
                    digit = np.int64(1) if base[s] == 2 else pos2[s] + 1
                code = code * base[s] + digit
            at = _slot_of_code(code, table, table.shape[0])
            old = table[at, 1] if table[at, 0] != -1 else -1
            if old >= 0 and node_g[old] <= g2 + eps:
                continue
            h = _heuristic(
                robot2, hand2, pos2, done2, d, least, potential, standing, end, in_hand, op_slot, op_where, op_mask,
                link, n_ops, c, work,
            )  # fmt: skip
            if g2 + h >= bound - eps:
                pruned = min(pruned, g2 + h)
                continue
            if old >= 0:
                closed[old] = True
            if count == capacity:
                capacity *= 2
                node_pos = np.concatenate((node_pos, np.full((count, n_slots), -1, dtype=np.int64)))
                node = np.concatenate((node, np.zeros((count, 3), dtype=np.int64)))
                node_g = np.concatenate((node_g, np.zeros(count)))
                parent = np.concatenate((parent, np.full(count, -1, dtype=np.int64)))
                action = np.concatenate((action, np.zeros((count, 3), dtype=np.int64)))
                closed = np.concatenate((closed, np.zeros(count, dtype=np.bool_)))
                pos = node_pos[i]
            if heap == len(heap_f):
                heap_f = np.concatenate((heap_f, np.zeros(heap)))
                heap_n = np.concatenate((heap_n, np.zeros(heap, dtype=np.int64)))
            j = count
            count += 1
            node[j, 0] = robot2
            node[j, 1] = hand2
            node[j, 2] = done2
            for s in range(n_slots):
                node_pos[j, s] = pos2[s]
            node_g[j] = g2
            parent[j] = i
            action[j, 0] = kind
            action[j, 1] = x
            action[j, 2] = b
            if table[at, 0] == -1 and count * 2 > table.shape[0]:
                table = _grown_table(table)
                at = _slot_of_code(code, table, table.shape[0])
            table[at, 0] = code
            table[at, 1] = j
            _push(heap_f, heap_n, heap, g2 + weight * h, j, eps)
            heap += 1
    return NO_PLAN, _INF, min(bound, pruned), empty, expanded
