"""Finds with a walk before or after them, where that costs less than the find from where the robot stands.

A table with one candidate set for all origins and targets obeys the triangle inequality, and every route here is the
find itself. Where every find has its own candidates (search/per_find.py), or prices come from outside, walking to
another place and searching from there may be cheaper, as a general planner would see. The built-in solver's errands
take these routes, so that its plans stay optimal.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, RELATIVE


class FindRoutes(NamedTuple):
    """The cheapest way of getting a missing thing from each place to each place.

    Attributes:
        metres: what it costs, shape (types, places, places).
        begin, end: the places between which the find itself is done; the walks are to the one and from the other.
    """

    metres: Floats
    begin: Ints
    end: Ints


@kernel()
def find_routes(tables: Floats, d: Floats) -> FindRoutes:
    """The routes; of equal ones (ties.py) that without a walk, else the first in the order of places.

    Args:
        tables: find costs, shape (types, places, places).
        d: metres, shape (places, places).
    """
    types, n = len(tables), len(d)
    half, metres = np.empty((n, n)), np.empty((types, n, n))
    first, begin, end = (
        np.empty((n, n), np.int64),
        np.empty((types, n, n), np.int64),
        np.empty((types, n, n), np.int64),
    )
    for t in range(types):
        for a in range(n):
            for b in range(n):
                m = _cheapest(d[a], tables[t, :, b], a)
                first[a, b], half[a, b] = m, tables[t, a, b] if m == a else d[a, m] + tables[t, m, b]
        for a in range(n):
            for b in range(n):
                m = _cheapest(half[a], d[:, b], b)
                metres[t, a, b] = half[a, b] if m == b else half[a, m] + d[m, b]
                begin[t, a, b], end[t, a, b] = first[a, m], m
    return FindRoutes(metres, begin, end)


@kernel()
def _cheapest(before: Floats, after: Floats, own: int) -> int:
    """By which place it is cheapest; its own where no other costs less."""
    best = np.inf
    for m in range(len(before)):
        best = min(best, before[m] + after[m])
    most = best + RELATIVE * max(MIN_SCALE, best)
    if before[own] + after[own] <= most:
        return own
    for m in range(len(before)):
        if before[m] + after[m] <= most:
            return m
    return own
