"""Exact A* search for the cheapest way to carry out one recipe, compiled with numba.

A state consists of the robot's location, the held slot, the location of each slot (or that its instance is not
chosen yet) and the set of finished operations. One move of the search is a whole errand: fetch a slot and carry it
somewhere, put it down, carry on, or walk somewhere and prepare. With one hand and metric travel, every optimal plan
is a sequence of errands.

The kernels take their arrays one by one: in a named tuple, each call unpacks all of them and counts its references to
each, and the same searches took 1.13 to 1.4 times as long (2186 searches of tasks, side by side in one process). For
that reason too the loop of `search_states` is one function.

Constants that kernels receive are np.int64: numba compiles a kernel once more for every literal. Rows are copied in
loops, since assigning a slice makes it compile the text of an error message. Together they halve the time that the
first use on a machine takes.
"""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

import numpy as np

from workbench.arrays import Ints
from workbench.planning.builtin.errand_moves import moves_from
from workbench.planning.builtin.lower_bounds import heuristic
from workbench.planning.builtin.search_interface import (
    CARRY,
    FETCH,
    LIMIT,
    NO_PLAN,
    PLACE,
    PREPARE,
    SOLVED,
    RecipeArrays,
    RecipeQuery,
)
from workbench.planning.builtin.search_queue import (
    INF,
    compiled,
    grown_table,
    pop,
    push,
    row_of_code,
)
from workbench.tolerances import MIN_SCALE, RELATIVE


def search(recipe: RecipeArrays, query: RecipeQuery) -> tuple[int, float, float, Ints, int]:
    """A* search from one state.

    Returns:
        (status, cost, lower bound, moves), moves of shape (n, 3) in reverse order, expanded nodes.
    """
    return search_states(*recipe, *query)


@compiled
def _roles(op_slot, op_where, n_ops, n_slots):
    """What operations do with each slot: whether none uses it, whether all hold it, and a bit mask of them."""
    carried_only = np.ones(n_slots, dtype=np.bool_)
    stands = np.zeros(n_slots, dtype=np.bool_)
    op_mask = np.zeros(n_slots, dtype=np.int64)
    for o in range(n_ops):
        for j in range(op_slot.shape[1]):
            s = op_slot[o, j]
            if s >= 0:
                carried_only[s] = False
                op_mask[s] |= 1 << o
                if op_where[o, j] == 0:
                    stands[s] = True
    tool = np.zeros(n_slots, dtype=np.bool_)  # by a loop: array formulas would load all of numba's ufuncs
    for s in range(n_slots):
        tool[s] = not (carried_only[s] or stands[s])
    return carried_only, tool, op_mask


@compiled
def _nodes(capacity, n_slots):
    """Space for so many nodes: locations of slots; robot, hand and done; cost; parent; move; whether expanded."""
    return (
        np.full((capacity, n_slots), -1, dtype=np.int64),
        np.zeros((capacity, 3), dtype=np.int64),
        np.zeros(capacity),
        np.full(capacity, -1, dtype=np.int64),
        np.zeros((capacity, 3), dtype=np.int64),
        np.zeros(capacity, dtype=np.bool_),
    )


@compiled
def _moves_to(i, parent, action):
    """The moves from the first node to node i, in reverse order, shape (n, 3)."""
    length = 0
    k = i
    while parent[k] >= 0:
        length += 1
        k = parent[k]
    moves = np.zeros((length, 3), dtype=np.int64)
    k = i
    for q in range(length):
        for j in range(3):
            moves[q, j] = action[k, j]
        k = parent[k]
    return moves


@compiled
def _code(robot, hand, done, pos, n_loc, base):
    """A state as one integer; base[s]: number of values of the location of slot s, 2 for in its place or not."""
    code = np.int64(done)
    code = code * n_loc + robot
    code = code * (len(base) + 1) + hand + 1
    for s in range(len(base)):
        digit = np.int64(0)
        if pos[s] >= 0:
            digit = np.int64(1) if base[s] == 2 else pos[s] + 1
        code = code * base[s] + digit
    return code


@compiled
def search_states(
    d, fetch, least, potential, standing, end, in_hand, op_slot, op_where, op_after, link, n_ops, c,
    robot0, hand0, g0, bound, max_nodes, first, staging, weight,
):  # fmt: skip
    """`search` with the fields of RecipeArrays and SearchQuery one by one; the module's docstring says why."""
    n_slots = fetch.shape[0]
    n_loc = d.shape[0]
    carried_only, tool, op_mask = _roles(op_slot, op_where, n_ops, n_slots)
    base = np.empty(n_slots, dtype=np.int64)
    for s in range(n_slots):
        base[s] = 2 if carried_only[s] and not staging else n_loc + 1
    all_done = (1 << n_ops) - 1
    capacity = np.int64(64)
    node_pos, node, node_g, parent, action, closed = _nodes(capacity, n_slots)
    heap_f = np.zeros(capacity)
    heap_n = np.zeros(capacity, dtype=np.int64)
    table = np.full((256, 2), -1, dtype=np.int64)
    count = np.int64(1)
    heap = np.int64(0)
    node[0, 0] = robot0
    node[0, 1] = hand0
    node_g[0] = g0
    work = np.zeros((max(n_ops, 1), n_loc))
    h0 = heuristic(
        robot0, hand0, node_pos[0], np.int64(0), d, least, potential, standing, end, in_hand, op_slot, op_where,
        op_mask, link, n_ops, c, work,
    )  # fmt: skip
    empty = np.zeros((0, 3), dtype=np.int64)
    eps = RELATIVE * max(MIN_SCALE, g0 + h0)
    if g0 + h0 >= bound - eps:
        return NO_PLAN, INF, g0 + h0, empty, 0
    push(heap_f, heap_n, heap, g0 + h0, np.int64(0), eps)
    heap += 1
    expanded = 0
    pruned = INF
    succ = np.zeros((n_slots * (2 * n_loc + 2) + n_ops * n_loc + n_loc + 4, 3), dtype=np.int64)
    cost = np.zeros(len(succ))
    pos2 = np.zeros(n_slots, dtype=np.int64)
    while heap > 0:
        f = heap_f[0]
        i = heap_n[0]
        pop(heap_f, heap_n, heap, eps)
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
            return SOLVED, g, g if weight == 1.0 else g0 + h0, _moves_to(i, parent, action), expanded
        expanded += 1
        if count > max_nodes:
            return LIMIT, INF, f if weight == 1.0 else g0 + h0, empty, expanded
        n = moves_from(
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
            code = _code(robot2, hand2, done2, pos2, n_loc, base)
            at = row_of_code(code, table, table.shape[0])
            old = table[at, 1] if table[at, 0] != -1 else -1
            if old >= 0 and node_g[old] <= g2 + eps:
                continue
            h = heuristic(
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
                more = _nodes(count, n_slots)
                node_pos, node = np.concatenate((node_pos, more[0])), np.concatenate((node, more[1]))
                node_g, parent = np.concatenate((node_g, more[2])), np.concatenate((parent, more[3]))
                action, closed = np.concatenate((action, more[4])), np.concatenate((closed, more[5]))
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
                table = grown_table(table)
                at = row_of_code(code, table, table.shape[0])
            table[at, 0] = code
            table[at, 1] = j
            push(heap_f, heap_n, heap, g2 + weight * h, j, eps)
            heap += 1
    return NO_PLAN, INF, min(bound, pruned), empty, expanded
