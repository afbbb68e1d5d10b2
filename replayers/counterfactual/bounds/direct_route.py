"""The longest legs of a run that goes straight from a state on, compiled with numba.

They are what an upper bound adds up (upper_bound.py).
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replayers.counterfactual.bounds.max_assignment import max_assignment
from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel

STOOD = -1
"""In place of a start: where an item stood."""


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


@kernel()
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
    farthest, some = _farthest_from_sites(metres, looks, sites)
    starts = np.full((here >= 0) + n + parts + (fetches if some and with_stood else 0), STOOD)
    if here >= 0:
        starts[0] = here
    for i in range(n):
        starts[(here >= 0) + i] = looks[i]
    for part in range(parts):
        starts[(here >= 0) + n + part] = ends[part]
    worth = np.zeros((n + min(parts, fetches), len(starts)))
    fetched, brought = np.zeros(parts), np.zeros(parts)
    for s in range(len(starts)):
        row, longest = metres[starts[s]] if starts[s] >= 0 else farthest, 0.0
        for i in range(n):
            worth[i, s] = row[looks[i]]
            longest = max(longest, worth[i, s])
        for part in range(parts):
            way = longest
            for site in sites[first[part] : first[part + 1]]:
                way = max(way, row[site])
            fetched[part] = max(fetched[part], way)
            if parts <= fetches:
                worth[n + part, s] = way
            else:
                for fetch in range(fetches):
                    worth[n + fetch, s] = max(worth[n + fetch, s], way)
    for part in range(parts):
        for look in looks:
            brought[part] = max(brought[part], metres[look, ends[part]])
        for site in sites[first[part] : first[part + 1]]:
            brought[part] = max(brought[part], metres[site, ends[part]])
    return LongestLegs(_assigned(worth), brought, fetched)


@kernel()
def _farthest_from_sites(metres: Floats, looks: Ints, sites: Ints) -> tuple[Floats, bool]:
    """The greatest distance of each location from the sites where nothing is left to look into, and whether there are
    such; shape (locations,)."""
    farthest, some = np.zeros(len(metres)), False
    for site in sites:
        looked_into = False
        for look in looks:
            looked_into |= look == site
        if not looked_into:
            some = True
            for to in range(len(metres)):
                farthest[to] = max(farthest[to], metres[site, to])
    return farthest, some


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
