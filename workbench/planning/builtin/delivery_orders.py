"""The cheapest orders of plain deliveries, compiled with numba."""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

from workbench.planning.builtin.search_queue import INF, compiled


@compiled
def two_cheapest(fetch, end, slots, here, c, orders):
    """The cheapest order, its cost, and that of the second; costs add up as in the search of states.

    Args:
        fetch, end, c: as in RecipeArrays.
        slots: those to be brought, shape (k,).
        here: where the robot stands.
        orders: every order of them, shape (k!, k).

    Returns:
        Row of orders, its cost, and the cost of the cheapest other one.
    """
    row, best, second = -1, INF, INF
    for p in range(len(orders)):
        cost, at = 0.0, here
        for q in range(orders.shape[1]):
            s = slots[orders[p, q]]
            cost += fetch[s, at, end[s]]
            cost += c
            at = end[s]
        if cost < best:
            second = best
            row, best = p, cost
        elif cost < second:
            second = cost
    return row, best, second
