"""The tables by which rollouts price the search for one missing item: Eq. 1 over its candidates, compiled, and a
rough cost of what comes after them.

Import this module lazily: importing numba takes most of a second.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.caches import PerObject
from workbench.search.candidates import choose
from workbench.search.costs import ActionCosts
from workbench.search.remaining import still_missing_by_subset, unconditioned
from workbench.third_party.kernels import kernel
from workbench.tolerances import RELATIVE
from workbench.worlds.travel import TravelCosts

CANDIDATES = 10
"""Candidates per type in Eq. 1 within rollouts."""

MAX_PROBABILITY = 1 - 1e-9

SEARCH_CACHE_SIZE = 256
"""Number of cached searches for one item, about 0.1 MB each."""


class FindTables(NamedTuple):
    """The tables of one missing item: as in DeliveryState, whose arrays have one row more for each find.

    Attributes:
        chance: shape (n,). candidates: shape (c,). missing: shape (2**c,). onward: shape (2**c, c).
    """

    chance: Floats
    candidates: Indices
    missing: Floats
    onward: Floats
    beyond: float


def find_tables(
    probability: Floats, containers: Indices, robot: int, target: int, travel: TravelCosts, costs: ActionCosts
) -> FindTables:
    """The tables of one missing item, cached: many states share them and differ only in the other items.

    Args:
        probability: of the item in each unsearched container, shape (n,).
        containers, robot, target: location indices, of the containers of shape (n,).
    """
    key = probability.tobytes(), containers.tobytes(), robot, target, costs
    return _TABLES.of(travel).get(key, lambda: _made(probability, containers, robot, target, travel.metres, costs))


_TABLES: PerObject[tuple[bytes, bytes, int, int, ActionCosts], FindTables] = PerObject(SEARCH_CACHE_SIZE)


def _made(
    probability: Floats, containers: Indices, robot: int, target: int, metres: Floats, costs: ActionCosts
) -> FindTables:
    p, to_m = probability[None], metres[containers, target]
    limit = min(CANDIDATES, len(containers))
    chosen = choose(p, metres[robot, containers], to_m, limit=limit, ranking="worth")
    chance = np.minimum(unconditioned(possible(probability)[None], "marginal")[0], MAX_PROBABILITY)
    missing = still_missing_by_subset(p, chosen, "marginal")[0]
    between = metres.take(containers, axis=0).take(containers, axis=1)
    beyond = _cost_beyond_candidates(chance, chosen[0], between, to_m) + costs.manipulation
    onward = remaining_costs(
        missing, chosen[0], beyond, between, to_m, float(costs.search), float(costs.manipulation)
    )
    return FindTables(chance=chance, candidates=chosen[0], missing=missing, onward=onward, beyond=beyond)


def possible(chances: Floats) -> Floats:
    """The chances without those that are, beside the greatest, no more than a rounding."""
    return np.where(chances > RELATIVE * chances.max(initial=0.0), chances, 0.0)


@kernel()
def remaining_costs(
    missing: Floats,
    candidates: Indices,
    beyond: float,
    between_m: Floats,
    to_m: Floats,
    look: float,
    handle: float,
) -> Floats:
    """The table of Eq. 1 for one type: reference.cost_table before its last step, shape (2**c, c).

    Args:
        missing: remaining.still_missing_by_subset of the candidates, shape (2**c,).
        candidates: container indices, shape (c,).
        beyond: cost of a find after all candidates have been searched.
        between_m, to_m: between all containers, shape (n, n), and from each to the target, shape (n,).
    """
    c = len(candidates)
    into = np.empty((c, c))  # from every other candidate to one, and the look there
    found = np.empty(c)
    for a in range(c):
        found[a] = handle + to_m[candidates[a]]
        for i in range(c):
            into[a, i] = between_m[candidates[i], candidates[a]] + look
    everything = (1 << c) - 1
    table = np.zeros((1 << c, c))
    table[everything] = missing[everything] * beyond
    best = np.empty(c)
    for subset in range(everything - 1, 0, -1):
        r = missing[subset]
        for i in range(c):
            best[i] = np.inf
        for a in range(c):
            if not subset >> a & 1:
                after = subset | 1 << a
                if_found, later = (r - missing[after]) * found[a], table[after, a]
                for i in range(c):
                    best[i] = min(best[i], r * into[a, i] + if_found + later)
        for i in range(c):
            if subset >> i & 1:
                table[subset, i] = best[i]
    return table


def _cost_beyond_candidates(chance: Floats, chosen: Indices, between_m: Floats, to_m: Floats) -> float:
    """A rough cost of searching on beyond the candidates, assuming that two in five of the other containers are
    searched: half of the median way between them for each, and the mean way to the target."""
    is_other = np.ones(len(chance), dtype=np.bool_)
    is_other[chosen] = False
    others = np.flatnonzero(is_other)
    if not len(others):
        return 0.0
    weight, ways = chance[others] + 1e-9, between_m.take(others, axis=0).take(others, axis=1).ravel()
    below, above = (len(ways) - 1) // 2, len(ways) // 2
    ways.partition((below, above))
    median = float(ways[below] + ways[above]) / 2.0
    return float(weight @ to_m[others] / weight.sum()) + 0.5 * median * max(1.0, 0.4 * len(others))
