"""The moves from a state of the recipe search, compiled with numba: whole errands, put-downs and preparations."""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

import numpy as np

from workbench.planning.builtin.search_interface import CARRY, CHOOSE, FETCH, PLACE, PREPARE
from workbench.planning.builtin.search_state import State, compiled

_INF = np.inf


@compiled
def write_moves(recipe, roles, query, state, last, succ, cost):
    """Write the moves from a state to succ and cost, and return their number.

    A move that needs no walking and belongs to every plan from here is the only one returned: an operation whose
    items are all here, or putting down an item that belongs here.

    Args:
        last: kind of the move that led here; -1 at the first state, where query.first applies.
        succ, cost: shape (any, 3): kind, slot or operation, place; and shape (any,).
    """
    first = query.first if last < 0 else -1
    robot, hand, done = state.robot, state.hand, state.done
    end, in_hand = recipe.end, recipe.in_hand
    if first < 0:
        for o in range(recipe.n_ops):
            if _operation_place(recipe, o, state) == robot:
                return _append_move(succ, cost, 0, PREPARE, o, robot, recipe.c)
        if hand >= 0 and end[hand] == robot and not in_hand[hand] and (roles.op_mask[hand] & ~done) == 0:
            return _append_move(succ, cost, 0, PLACE, hand, robot, recipe.c)
    n = 0
    for s in range(len(state.pos)):
        if first < 0 and state.pos[s] < 0 and hand != s:
            n = _write_choices(recipe, roles, state, s, succ, cost, n)
        if hand < 0 and (first < 0 or s == first):
            n = _write_fetches(recipe, roles, query.staging, state, s, succ, cost, n)
    if hand >= 0 and (first < 0 or hand == first):
        n = _write_carries(recipe, roles, query.staging, state, last, succ, cost, n)
    if first < 0:
        for o in range(recipe.n_ops):
            where = _operation_place(recipe, o, state)
            if where >= 0:
                n = _append_move(succ, cost, n, PREPARE, o, where, recipe.c + recipe.d[robot, where])
    return n


@compiled
def _append_move(succ, cost, n, kind, x, b, w):
    succ[n, 0] = kind
    succ[n, 1] = x
    succ[n, 2] = b
    cost[n] = w
    return n + 1


@compiled
def _write_choices(recipe, roles, state, s, succ, cost, n):
    """Choosing an instance of a slot that stands in place already, which costs nothing."""
    pending = (roles.op_mask[s] & ~state.done) != 0
    end = recipe.end[s]
    for a in range(recipe.d.shape[0]):
        here = recipe.standing[s, a] and (pending or (end == a and not recipe.in_hand[s]))
        if here and (not roles.carried_only[s] or a == end):
            n = _append_move(succ, cost, n, CHOOSE, s, a, 0.0)
    return n


@compiled
def _write_fetches(recipe, roles, staging, state, s, succ, cost, n):
    """Fetching a slot with a free hand and carrying it to a place."""
    d, c, fetch = recipe.d, recipe.c, recipe.fetch
    robot, at, end, held = state.robot, state.pos[s], recipe.end[s], recipe.in_hand[s]
    pending = (roles.op_mask[s] & ~state.done) != 0
    if not pending and (end < 0 or (at == end and not held)):
        return n
    for b in range(d.shape[0]):
        if not staging and b != end:
            if not pending:
                continue
            if roles.tool[s] and not _partner_stands(recipe, s, b, state):
                continue
        w = fetch[s, robot, b] if at < 0 else d[robot, at] + c + d[at, b]
        if w < _INF and (at != b or roles.tool[s] or held):
            n = _append_move(succ, cost, n, FETCH, s, b, w)
    return n


@compiled
def _write_carries(recipe, roles, staging, state, last, succ, cost, n):
    """Putting down the slot in hand, or carrying it on."""
    robot, hand = state.robot, state.hand
    end = recipe.end[hand]
    pending = (roles.op_mask[hand] & ~state.done) != 0
    useful = staging or not roles.carried_only[hand] or robot == end
    if useful and (staging or not recipe.in_hand[hand] or pending):
        n = _append_move(succ, cost, n, PLACE, hand, robot, recipe.c)
    if last != FETCH and last != CARRY:
        for b in range(recipe.d.shape[0]):
            if b != robot and (staging or pending or b == end):
                n = _append_move(succ, cost, n, CARRY, hand, b, recipe.d[robot, b])
    return n


@compiled
def _partner_stands(recipe, s, b, state):
    """Whether the other parts of some operation of the tool in hand stand at b."""
    op_slot = recipe.op_slot
    for o in range(recipe.n_ops):
        if (state.done >> o) & 1:
            continue
        mine = False
        others = True
        for j in range(op_slot.shape[1]):
            if op_slot[o, j] == s:
                mine = True
            elif op_slot[o, j] >= 0 and state.pos[op_slot[o, j]] != b:
                others = False
        if mine and others:
            return True
    return False


@compiled
def _operation_place(recipe, o, state):
    """The place where an operation can be done with the items there and the item in hand, or -1."""
    op_slot, pos, hand = recipe.op_slot, state.pos, state.hand
    if (state.done >> o) & 1 or (recipe.op_after[o] & ~state.done) != 0:
        return -1
    where = -1
    needs_hand = False
    for j in range(op_slot.shape[1]):
        s = op_slot[o, j]
        if s < 0:
            continue
        if recipe.op_where[o, j] == 1:
            needs_hand = True
            if hand != s:
                return -1
        elif hand == s or pos[s] < 0 or (where >= 0 and pos[s] != where):
            return -1
        else:
            where = pos[s]
    if needs_hand:
        return state.robot if where < 0 or where == state.robot else -1
    return -1 if hand >= 0 else (state.robot if where < 0 else where)


@compiled
def after_move(state, move, pos):
    """The state after a move; its locations are written to pos."""
    kind, x, b = move[0], move[1], move[2]
    robot, hand, done = state.robot, state.hand, state.done
    for s in range(len(pos)):
        pos[s] = state.pos[s]
    if kind == FETCH:
        robot = b
        hand = x
        pos[x] = -1
    elif kind == PLACE:
        hand = np.int64(-1)
        pos[x] = b
    elif kind == CARRY:
        robot = b
    elif kind == PREPARE:
        robot = b
        done = done | (1 << x)
    else:
        pos[x] = b
    return State(robot, hand, done, pos)
