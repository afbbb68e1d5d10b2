"""Moves of the recipe search: whole errands, operations and choices of an instance, compiled with numba."""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

import numpy as np

from workbench.planning.builtin.search_interface import CARRY, CHOOSE, FETCH, PLACE, PREPARE
from workbench.planning.builtin.search_queue import INF, compiled


@compiled
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


@compiled
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


@compiled
def _append_move(succ, cost, n, kind, x, b, w):
    succ[n, 0] = kind
    succ[n, 1] = x
    succ[n, 2] = b
    cost[n] = w
    return n + 1


@compiled
def moves_from(
    robot, hand, pos, done, at_root, last, first, staging, d, fetch, standing, end, in_hand, op_slot, op_where,
    op_after, op_mask, carried_only, tool, n_ops, c, succ, cost,
):  # fmt: skip
    """Write the moves from a state to succ and cost, and return their number.

    A move that needs no walking and belongs to every plan from here is the only one returned: an operation whose
    items are all here, or putting down an item that belongs here. astar.py says why this takes no named tuple.
    """
    n = np.int64(0)
    if first < 0:
        for o in range(n_ops):
            if _operation_place(o, robot, hand, pos, done, op_slot, op_where, op_after) == robot:
                return _append_move(succ, cost, n, np.int64(PREPARE), o, robot, c)
        if hand >= 0 and end[hand] == robot and not in_hand[hand] and (op_mask[hand] & ~done) == 0:
            return _append_move(succ, cost, n, np.int64(PLACE), hand, robot, c)
    for s in range(len(pos)):
        pending = (op_mask[s] & ~done) != 0
        if first < 0 and pos[s] < 0 and hand != s:
            # Choosing an instance that stands in place already costs nothing.
            for a in range(d.shape[0]):
                here = standing[s, a] and (pending or (end[s] == a and not in_hand[s]))
                if here and (not carried_only[s] or a == end[s]):
                    n = _append_move(succ, cost, n, np.int64(CHOOSE), s, a, 0.0)
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
            if w < INF and (pos[s] != b or tool[s] or in_hand[s]):
                n = _append_move(succ, cost, n, np.int64(FETCH), s, b, w)
    if hand >= 0 and (first < 0 or hand == first):
        pending = (op_mask[hand] & ~done) != 0
        useful = staging or not carried_only[hand] or robot == end[hand]
        if useful and (staging or not in_hand[hand] or pending):
            n = _append_move(succ, cost, n, np.int64(PLACE), hand, robot, c)
        if (last != FETCH and last != CARRY) or at_root:
            for b in range(d.shape[0]):
                if b != robot and (staging or pending or b == end[hand]):
                    n = _append_move(succ, cost, n, np.int64(CARRY), hand, b, d[robot, b])
    if first < 0:
        for o in range(n_ops):
            where = _operation_place(o, robot, hand, pos, done, op_slot, op_where, op_after)
            if where >= 0:
                n = _append_move(succ, cost, n, np.int64(PREPARE), o, where, c + d[robot, where])
    return n
