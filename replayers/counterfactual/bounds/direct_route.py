"""The longest legs of a run that goes straight from a state on, compiled with numba.

They are what an upper bound adds up (upper_bound.py).
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replayers.counterfactual.bounds import max_assignment as assignments
from replayers.counterfactual.bounds.max_assignment import max_assignment
from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel


class LongestLegs(NamedTuple):
    """Legs in metres.

    Attributes:
        assigned: legs into looks and to items, in the most expensive assignment of distinct starts to them.
        brought: the longest way on which each part's item can be brought, shape (parts,).
        fetched: the longest way to each part's item, shape (parts,).
    """

    assigned: Floats
    brought: Floats
    fetched: Floats


@kernel(beside=(assignments,))
def longest_legs(
    metres: Floats, here: int, looks: Ints, ends: Ints, sites: Ints, first: Ints, fetches: int, with_stood: bool
) -> LongestLegs:
    """The longest legs from one state on.

    Args:
        metres: between all locations, shape (locations, locations).
        here: the robot's location index, or -1 where it has none.
        looks: location indices of the containers that are left.
        ends: location indices of where the parts are wanted, shape (parts,).
        sites, first: location indices of where each part's item is known to stand, and where those of each part begin
            in them, shape (parts + 1,).
        fetches: how many parts are fetched.
        with_stood: so many legs to items may also start where one stood.
    """
    n, parts = len(looks), len(ends)
    starts = _rows_of_starts(metres, here, looks, ends, sites, fetches if with_stood else 0)
    fetched_rows = parts if parts <= fetches else fetches
    worth = np.zeros((n + fetched_rows, len(starts)))
    fetched, brought = np.zeros(parts), np.zeros(parts)
    for s in range(len(starts)):
        longest = 0.0
        for i in range(n):
            worth[i, s] = starts[s, looks[i]]
            longest = max(longest, worth[i, s])
        for part in range(parts):
            way = longest
            for site in sites[first[part] : first[part + 1]]:
                way = max(way, starts[s, site])
            fetched[part] = max(fetched[part], way)
            if parts <= fetches:
                worth[n + part, s] = way
            else:
                for row in range(fetches):
                    worth[n + row, s] = max(worth[n + row, s], way)
    for part in range(parts):
        for look in looks:
            brought[part] = max(brought[part], metres[look, ends[part]])
        for site in sites[first[part] : first[part + 1]]:
            brought[part] = max(brought[part], metres[site, ends[part]])
    return LongestLegs(_assigned(worth), brought, fetched)


@kernel()
def _rows_of_starts(metres: Floats, here: int, looks: Ints, ends: Ints, sites: Ints, times: int) -> Floats:
    """Metres to all locations from each start: here, each look and each end, and so many times the farthest of the
    sites where nothing is left to look into; shape (starts, locations)."""
    locations = len(metres)
    is_look, stood = np.zeros(locations, np.bool_), np.zeros(locations, np.bool_)
    for look in looks:
        is_look[look] = True
    some = False
    for site in sites:
        if not is_look[site]:
            stood[site] = some = True
    fixed = (here >= 0) + len(looks) + len(ends)
    rows = np.zeros((fixed + (times if some else 0), locations))
    for to in range(locations):
        if here >= 0:
            rows[0, to] = metres[here, to]
        for i in range(len(looks)):
            rows[(here >= 0) + i, to] = metres[looks[i], to]
        for i in range(len(ends)):
            rows[fixed - len(ends) + i, to] = metres[ends[i], to]
        for i in range(fixed, len(rows)):
            for site in range(locations):
                if stood[site]:
                    rows[i, to] = max(rows[i, to], metres[site, to])
    return rows


@kernel()
def _assigned(worth: Floats) -> Floats:
    """The worths of the pairs of the most expensive assignment, in the order of the rows."""
    pairs, count = np.empty(min(worth.shape)), 0
    if len(pairs):
        chosen = max_assignment(worth)
        for row in range(len(worth)):
            if chosen[row] >= 0:
                pairs[count] = worth[row, chosen[row]]
                count += 1
    return pairs
