"""Exact A* search for the cheapest way to carry out one recipe, compiled with numba.

A state consists of the robot's location, the held slot, the location of each slot (or that its instance is not
chosen yet) and the set of finished operations (search_state.py). One move of the search is a whole errand: fetch a
slot and carry it somewhere, put it down, carry on, or walk somewhere and prepare (errand_moves.py). With one hand
and metric travel, every optimal plan is a sequence of errands. The heuristic is admissible (lower_bounds.py).
"""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

import numpy as np

from workbench.planning.builtin.errand_moves import after_move, write_moves
from workbench.planning.builtin.lower_bounds import heuristic
from workbench.planning.builtin.search_interface import LIMIT, NO_PLAN, SOLVED
from workbench.planning.builtin.search_state import (
    State,
    compiled,
    grown_nodes,
    grown_table,
    moves_to,
    new_nodes,
    pop,
    push,
    roles_of,
    slot_of_code,
    state_code,
    state_of,
    write_node,
)
from workbench.search.ties import RELATIVE, SMALLEST_SCALE

_INF = np.inf


@compiled
def search(recipe, query):
    """A* search from one state.

    Args:
        recipe: RecipeArrays.
        query: SearchQuery.

    Returns:
        (status, cost, lower bound, moves), moves of shape (n, 3) in reverse order, expanded nodes.
    """
    slots = recipe.fetch.shape[0]
    roles = roles_of(recipe)
    start = State(np.int64(query.robot), np.int64(query.hand), np.int64(0), np.full(slots, -1, dtype=np.int64))
    work = np.zeros((max(recipe.n_ops, 1), recipe.d.shape[0]))
    least = query.spent + heuristic(recipe, roles.op_mask, start, work)
    eps = RELATIVE * max(SMALLEST_SCALE, least)
    if least >= query.bound - eps:
        return NO_PLAN, _INF, least, np.zeros((0, 3), dtype=np.int64), 0
    return _search_from(recipe, roles, query, start, work, least, eps)


@compiled
def _search_from(recipe, roles, query, start, work, least, eps):
    """The search from a start with a lower bound below the one to beat."""
    empty = np.zeros((0, 3), dtype=np.int64)
    n_slots, n_loc = recipe.fetch.shape[0], recipe.d.shape[0]
    base = _code_bases(roles, n_loc, query.staging)
    nodes = new_nodes(64, n_slots)
    write_node(nodes, 0, start, query.spent, -1, np.zeros(3, dtype=np.int64))
    count, heap, expanded, pruned = 1, 1, 0, _INF
    heap_f, heap_n = np.zeros(64), np.zeros(64, dtype=np.int64)
    heap_f[0] = least
    table = np.full((256, 2), -1, dtype=np.int64)
    succ = np.zeros((n_slots * (2 * n_loc + 2) + recipe.n_ops * n_loc + n_loc + 4, 3), dtype=np.int64)
    cost = np.zeros(len(succ))
    scratch = np.zeros(n_slots, dtype=np.int64)
    while heap > 0:
        f, i = heap_f[0], heap_n[0]
        pop(heap_f, heap_n, heap, eps)
        heap -= 1
        if nodes.closed[i]:
            continue
        nodes.closed[i] = True
        state, g = state_of(nodes, i), nodes.cost[i]
        if _is_goal(recipe, state):
            return SOLVED, g, g if query.weight == 1.0 else least, moves_to(nodes, i), expanded
        expanded += 1
        if count > query.most_nodes:
            return LIMIT, _INF, f if query.weight == 1.0 else least, empty, expanded
        last = nodes.move[i, 0] if i > 0 else -1
        for k in range(write_moves(recipe, roles, query, state, last, succ, cost)):
            reached, g2 = after_move(state, succ[k], scratch), g + cost[k]
            code = state_code(reached, n_loc, base)
            at = slot_of_code(code, table, table.shape[0])
            old = table[at, 1] if table[at, 0] != -1 else -1
            if old >= 0 and nodes.cost[old] <= g2 + eps:
                continue
            h = heuristic(recipe, roles.op_mask, reached, work)
            if g2 + h >= query.bound - eps:
                pruned = min(pruned, g2 + h)
                continue
            if old >= 0:
                nodes.closed[old] = True
            if count == len(nodes.cost):
                nodes = grown_nodes(nodes)
            if heap == len(heap_f):
                heap_f = np.concatenate((heap_f, np.zeros(heap)))
                heap_n = np.concatenate((heap_n, np.zeros(heap, dtype=np.int64)))
            write_node(nodes, count, reached, g2, i, succ[k])
            if table[at, 0] == -1 and (count + 1) * 2 > table.shape[0]:
                table = grown_table(table)
                at = slot_of_code(code, table, table.shape[0])
            table[at, 0], table[at, 1] = code, count
            push(heap_f, heap_n, heap, g2 + query.weight * h, count, eps)
            count, heap = count + 1, heap + 1
    return NO_PLAN, _INF, min(query.bound, pruned), empty, expanded


@compiled
def _code_bases(roles, n_loc, staging):
    """How many values the location of each slot takes in a state's code."""
    base = np.empty(len(roles.carried_only), dtype=np.int64)
    for s in range(len(base)):
        base[s] = 2 if roles.carried_only[s] and not staging else n_loc + 1
    return base


@compiled
def _is_goal(recipe, state):
    if state.done != (1 << recipe.n_ops) - 1:
        return False
    for s in range(len(state.pos)):
        t = recipe.end[s]
        if t >= 0:
            if recipe.in_hand[s]:
                if state.hand != s or state.robot != t:
                    return False
            elif state.hand == s or state.pos[s] != t:
                return False
    return True
