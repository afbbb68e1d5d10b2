"""States of the compiled recipe search: the state itself, the roles of slots, and the nodes, table and queue in
which the search keeps what it has reached.
"""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numba
import numpy as np


def compiled(function: Any) -> Any:
    """The function compiled by numba, kept on disk; it releases the GIL."""
    return cast(Any, numba.njit(cache=True, nogil=True)(function))


class State(NamedTuple):
    """A state of the search.

    Attributes:
        robot: the robot's location.
        hand: the slot in its hand, or -1.
        done: bit mask of the finished operations.
        pos: location of each slot, -1 while it is in hand or its instance is not chosen.
    """

    robot: Any
    hand: Any
    done: Any
    pos: Any


class Roles(NamedTuple):
    """What the operations of a recipe do with each slot; shape (slots,).

    Attributes:
        carried_only: whether no operation uses it.
        tool: whether operations use it, all in hand.
        op_mask: bit mask of the operations that use it.
    """

    carried_only: Any
    tool: Any
    op_mask: Any


class Nodes(NamedTuple):
    """Reached states, one a row; the arrays are longer than the number of states.

    Attributes:
        pos: shape (n, slots); at: robot, hand and done, shape (n, 3).
        cost: cost so far; parent: row of the state before; move: kind, slot or operation, place, shape (n, 3).
        closed: whether it has been expanded.
    """

    pos: Any
    at: Any
    cost: Any
    parent: Any
    move: Any
    closed: Any


@compiled
def roles_of(recipe):
    """The roles of a recipe's slots."""
    slots = recipe.fetch.shape[0]
    carried_only = np.ones(slots, dtype=np.bool_)
    stands = np.zeros(slots, dtype=np.bool_)
    op_mask = np.zeros(slots, dtype=np.int64)
    for o in range(recipe.n_ops):
        for j in range(recipe.op_slot.shape[1]):
            s = recipe.op_slot[o, j]
            if s >= 0:
                carried_only[s] = False
                op_mask[s] |= 1 << o
                if recipe.op_where[o, j] == 0:
                    stands[s] = True
    return Roles(carried_only, ~carried_only & ~stands, op_mask)


@compiled
def new_nodes(capacity, slots):
    """Room for so many states."""
    return Nodes(
        np.full((capacity, slots), -1, dtype=np.int64),
        np.zeros((capacity, 3), dtype=np.int64),
        np.zeros(capacity),
        np.full(capacity, -1, dtype=np.int64),
        np.zeros((capacity, 3), dtype=np.int64),
        np.zeros(capacity, dtype=np.bool_),
    )


@compiled
def grown_nodes(nodes):
    """The nodes with room for twice as many."""
    capacity, slots = nodes.pos.shape
    more = new_nodes(capacity, slots)
    return Nodes(
        np.concatenate((nodes.pos, more.pos)),
        np.concatenate((nodes.at, more.at)),
        np.concatenate((nodes.cost, more.cost)),
        np.concatenate((nodes.parent, more.parent)),
        np.concatenate((nodes.move, more.move)),
        np.concatenate((nodes.closed, more.closed)),
    )


@compiled
def state_of(nodes, i):
    """The state of a node."""
    return State(nodes.at[i, 0], nodes.at[i, 1], nodes.at[i, 2], nodes.pos[i])


@compiled
def write_node(nodes, j, state, cost, parent, move):
    """Write a state to row j."""
    nodes.at[j, 0] = state.robot
    nodes.at[j, 1] = state.hand
    nodes.at[j, 2] = state.done
    for s in range(len(state.pos)):
        nodes.pos[j, s] = state.pos[s]
    nodes.cost[j] = cost
    nodes.parent[j] = parent
    for k in range(3):
        nodes.move[j, k] = move[k]


@compiled
def moves_to(nodes, i):
    """The moves from the first node to node i, in reverse order, shape (n, 3)."""
    length = 0
    k = i
    while nodes.parent[k] >= 0:
        length += 1
        k = nodes.parent[k]
    moves = np.zeros((length, 3), dtype=np.int64)
    k = i
    for q in range(length):
        moves[q] = nodes.move[k]
        k = nodes.parent[k]
    return moves


@compiled
def state_code(state, n_loc, base):
    """A state as one integer; base: number of digits of each slot's location (2: in its place or not)."""
    slots = len(base)
    code = np.int64(state.done)
    code = code * n_loc + state.robot
    code = code * (slots + 1) + state.hand + 1
    for s in range(slots):
        digit = np.int64(0)
        if state.pos[s] >= 0:
            digit = np.int64(1) if base[s] == 2 else state.pos[s] + 1
        code = code * base[s] + digit
    return code


@compiled
def slot_of_code(code, table, size):
    """The row of a code in the hash table, or the free row for it."""
    h = code * np.int64(-7046029254386353131)
    i = ((h >> 20) ^ h) & (size - 1)
    while table[i, 0] != -1 and table[i, 0] != code:
        i = (i + 1) & (size - 1)
    return i


@compiled
def grown_table(table):
    """The hash table with twice as many rows."""
    size = table.shape[0] * 2
    bigger = np.full((size, 2), -1, dtype=np.int64)
    for i in range(table.shape[0]):
        if table[i, 0] != -1:
            j = slot_of_code(table[i, 0], bigger, size)
            bigger[j, 0] = table[i, 0]
            bigger[j, 1] = table[i, 1]
    return bigger


@compiled
def _before(f, n, other_f, other_n, eps):
    """Whether a state is looked at before another: it costs less, or the same (ties.py) and is younger."""
    return f < other_f - eps or (f <= other_f + eps and n > other_n)


@compiled
def push(heap_f, heap_n, count, f, n, eps):
    """Add node n of estimated cost f to a heap of so many entries."""
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


@compiled
def pop(heap_f, heap_n, count, eps):
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
