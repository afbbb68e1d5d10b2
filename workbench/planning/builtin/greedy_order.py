"""An approximate order of many errands, where an exact search is too expensive: nearest neighbour, then or-opt.

An errand fetches one item and carries it to its target. Going from the end of errand i through errand j costs
`leg[i, j]`, so the best order is a travelling-salesman path. The nearest-neighbour order is improved by moving
segments of up to three errands (or-opt, Or 1976) until no move helps.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from workbench.arrays import Floats
from workbench.search.ties import first_least, tolerance

MAX_IMPROVEMENTS = 200
"""Limit on the number of errands that are improved, and on the number of moves."""
MAX_SEGMENT = 3


def errand_order(leg: Floats) -> tuple[float, tuple[int, ...]]:
    """A good order of all errands and its cost; infinite if some errand is infeasible.

    Args:
        leg: shape (1 + errands, errands): from the start (row 0) or the end of errand i (row 1 + i) to the end
            of j.
    """
    order = _nearest_first(leg)
    if len(order) <= MAX_IMPROVEMENTS:
        for _ in range(MAX_IMPROVEMENTS):
            mended = _improved(leg, order)
            if mended is None:
                break
            order = mended
    return _cost(leg, order), order


def _nearest_first(leg: Floats) -> tuple[int, ...]:
    left, order, row = list(range(leg.shape[1])), list[int](), 0
    while left:
        nearest = left[first_least(leg[row, left])]
        left.remove(nearest)
        order.append(nearest)
        row = 1 + nearest
    return tuple(order)


def _cost(leg: Floats, order: tuple[int, ...]) -> float:
    rows = [0, *(1 + i for i in order[:-1])]
    return float(leg[rows, list(order)].sum()) if order else 0.0


def _improved(leg: Floats, order: tuple[int, ...]) -> tuple[int, ...] | None:
    """The order with one segment moved to where it saves most, of equal moves the first; None when nothing saves."""
    now = _cost(leg, order)
    moves: list[tuple[float, tuple[int, ...]]] = []
    for length in range(1, MAX_SEGMENT + 1):
        for i in range(len(order) - length + 1):
            segment, rest = order[i : i + length], order[:i] + order[i + length :]
            rows = np.array([0, *(1 + k for k in rest)])
            base = _cost(leg, rest) + _within_segment(leg, segment)
            costs = base + leg[rows, segment[0]]
            if len(rest) > 0:
                costs[:-1] += leg[1 + segment[-1], list(rest)] - leg[rows[:-1], list(rest)]
            at = first_least(costs, scale=now)
            moves.append((float(costs[at]), rest[:at] + segment + rest[at:]))
    if not moves:
        return None
    least, best = moves[first_least([cost for cost, _ in moves], scale=now)]
    return best if least < now - tolerance(now) else None


def _within_segment(leg: Floats, segment: tuple[int, ...]) -> float:
    return float(sum(leg[1 + a, b] for a, b in pairwise(segment)))
