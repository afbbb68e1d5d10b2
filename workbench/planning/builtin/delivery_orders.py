"""The cheapest plan of plain deliveries in one call, compiled with numba.

A replay solves thousands of such problems of five places, and one call for each of the kernels that this is made of
takes nearly twice as long.
"""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

import numpy as np

from workbench.planning.builtin.astar import search_states
from workbench.planning.builtin.find_routes import find_routes
from workbench.planning.builtin.lower_bounds import errand_costs
from workbench.planning.builtin.recipe_arrays import MAX_POTENTIALS
from workbench.planning.builtin.search_interface import NO_PLAN
from workbench.planning.builtin.search_queue import INF, compiled
from workbench.tolerances import MIN_SCALE, RELATIVE


@compiled
def cheapest_delivery(
    metres, rows, tables, at, find, end, in_hand, operations, here, c, orders, clearly, max_nodes
):  # fmt: skip
    """The cheapest order of deliveries, where it is clearly cheaper than every other, and than every plan that puts
    things down on the way.

    Args:
        metres: between all locations, shape (locations, locations).
        rows: of the problem's places in it, shape (places,).
        tables: find costs, shape (types, places, places).
        at: places of each slot's known instances, padded with -1, shape (slots, instances).
        find: table indices of its missing instances, padded with -1, same shape.
        end: the place to which each slot is brought, shape (slots,).
        in_hand: zeros, shape (slots,).
        operations: op_slot, op_where, op_after and link of RecipeArrays, of a recipe without operations.
        here: where the robot stands.
        c: cost of a manipulation.
        orders: every order of the slots that are left, shape (orders, left).
        clearly: how many tolerances an order must be cheaper than every other, and a manipulation must cost.
        max_nodes: of the search for a plan that puts things down on the way.

    Returns:
        The row of the cheapest order, -1 where none is clearly the cheapest; its cost; how many states the search
        expanded; and of each of its errands the instance, and the places between which a missing one is found, shape
        (left, 3).
    """
    n, legs = len(rows), np.zeros((orders.shape[1], 3), dtype=np.int64)
    d = np.empty((n, n))
    for a in range(n):
        for b in range(n):
            d[a, b] = metres[rows[a], rows[b]]
    routes = find_routes(tables, d)
    potential = _potentials(d, end)
    fetch, least, standing = errand_costs(at, find, routes.metres, d, potential, c)
    row, cost, second = _two_cheapest(fetch, end, here, c, orders)
    if not cost < INF or min(second - cost, c) <= clearly * RELATIVE * max(MIN_SCALE, cost):
        return -1, cost, 0, legs
    op_slot, op_where, op_after, link = operations
    status, _, _, _, expanded = search_states(
        d, fetch, least, potential, standing, end, in_hand, op_slot, op_where, op_after, link, np.int64(0), c,
        here, np.int64(-1), 0.0, cost, max_nodes, np.int64(-1), np.bool_(True), 1.0,
    )  # fmt: skip
    if status != NO_PLAN:
        return -1, cost, expanded, legs
    robot = here
    for q in range(orders.shape[1]):
        s = orders[row, q]
        j = _instance(at[s], find[s], routes.metres, d, robot, end[s], c)
        legs[q, 0] = j
        if at[s, j] < 0:
            legs[q, 1] = routes.begin[find[s, j], robot, end[s]]
            legs[q, 2] = routes.end[find[s, j], robot, end[s]]
        robot = end[s]
    return row, cost, expanded, legs


@compiled
def _potentials(d, end):
    """The zero potential, and the distances to the first places at which things end, shape (potentials, places)."""
    n = len(d)
    potential = np.zeros((1 + min(MAX_POTENTIALS, len(end)), n))
    used = 1
    for place in range(n):
        is_end = False
        for s in range(len(end)):
            is_end |= end[s] == place
        if is_end and used <= MAX_POTENTIALS:
            for a in range(n):
                potential[used, a] = d[a, place]
            used += 1
    return potential[:used]


@compiled
def _two_cheapest(fetch, end, here, c, orders):
    """The row of the cheapest order, its cost, and that of the second; costs add up as in the search of states."""
    row, best, second = -1, INF, INF
    for p in range(len(orders)):
        cost, at = 0.0, here
        for q in range(orders.shape[1]):
            s = orders[p, q]
            cost += fetch[s, at, end[s]]
            cost += c
            at = end[s]
        if cost < best:
            second = best
            row, best = p, cost
        elif cost < second:
            second = cost
    return row, best, second


@compiled
def _instance(at, find, tables, d, a, b, c):
    """The first instance of a slot that costs least to fetch from one place to another (ties.py)."""
    least = INF
    for j in range(len(at)):
        least = min(least, _fetch_cost(at[j], find[j], tables, d, a, b, c))
    for j in range(len(at)):
        if _fetch_cost(at[j], find[j], tables, d, a, b, c) <= least + RELATIVE * max(MIN_SCALE, least):
            return j
    return 0


@compiled
def _fetch_cost(k, table, tables, d, a, b, c):
    if k >= 0:
        return d[a, k] + c + d[k, b]
    return tables[table, a, b] if table >= 0 else INF
