"""Eq. 1 by dynamic programming over subsets, in numpy: the readable reference for the compiled implementation.

With R(S) the probability that the object is still missing after S has been searched (remaining.py), weighting each
step by the probability that it is taken gives one recursion for every belief model:

    W(S, i) = min over a not in S of
              R(S) (d(i, a) + R_search) + (R(S) - R(S + a)) (R_pick + d(a, to)) + W(S + a, a)

with W = 0 when every candidate has been searched; the find cost is W(nothing, origin).

Worked out by hand, for three containers on a line at 1, 3 and 6 m with the origin and the target at 0 m, p = 0.2,
0.5, 0.8 independent, search 0 and pick 5. Nearest first costs

    1 + .2 (5 + 1) + .8 [2 + .5 (5 + 3) + .5 [3 + .8 (5 + 6)]] = 11.72

the likeliest first  6 + .8 (11) + .2 [3 + .5 (8) + .5 [2 + .2 (6)]] = 16.52, and no order costs less than 11.72.
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.search.ties import first_least


def cost_table(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, tail: Floats | None = None
) -> Floats:
    """W(nothing, origin) for every item type, origin and target.

    Args:
        missing: R(S), shape (item types, 2**k).
        between_m: d(i, a) between candidates, shape (item types, k, k).
        from_m: metres from each origin to each candidate, shape (item types, origins, k).
        found: R_pick + d(a, to), shape (item types, k, targets).
        search: R_search.
        tail: W(all candidates, i), the cost after every candidate has been searched, i being the last: shape
            (item types, k, targets); None for nothing, as in the paper.

    Returns:
        Shape (item types, origins, targets).
    """
    answer = np.empty((from_m.shape[0], from_m.shape[1], found.shape[2]))
    for item in range(len(answer)):
        ends = np.zeros_like(found[item]) if tail is None else tail[item]
        table = subset_costs(missing[item], between_m[item], found[item], search, ends)
        answer[item] = _min_over_next(missing[item], from_m[item], found[item], search, table, 0)
    return answer


def pair_costs(
    missing: Floats,
    sets: Indices,
    between_m: Floats,
    from_m: Floats,
    found: Floats,
    search: float,
    start: Indices,
    pairs: Indices,
) -> Floats:
    """W(nothing, origin) of pairs of an origin and a target, where pairs differ in their candidates.

    Args:
        missing: R(S) of each set of candidates, shape (sets, 2**k).
        sets: containers, shape (sets, k).
        between_m: between all containers, shape (containers, containers).
        from_m: shape (origins, containers).
        found: R_pick + d(a, to), shape (containers, targets).
        start: set u belongs to the pairs start[u] up to start[u + 1], shape (sets + 1,).
        pairs: an origin and a target each, shape (pairs, 2).

    Returns:
        Shape (pairs,).
    """
    answer = np.empty(len(pairs))
    for u, chosen in enumerate(sets):
        these = pairs[start[u] : start[u + 1]]
        legs = between_m[np.ix_(chosen, chosen)][None]
        table = cost_table(missing[u : u + 1], legs, from_m[None, :, chosen], found[None, chosen], search)
        answer[start[u] : start[u + 1]] = table[0, these[:, 0], these[:, 1]]
    return answer


def best_order(missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float) -> list[int]:
    """The minimiser's order of candidates from one origin to one target; of equal ones (ties.py) the earlier.

    Args:
        missing: shape (2**k,).
        between_m: shape (k, k).
        from_m, found: shape (k,).
    """
    table = subset_costs(missing, between_m, found[:, None], search, np.zeros((len(found), 1)))
    order: list[int] = []
    subset, row, whole = 0, from_m, 0.0
    while len(order) < len(between_m):
        left = [a for a in range(len(between_m)) if not subset >> a & 1]
        steps = _next_step_terms(missing, row[None], found[:, None], search, table, subset)[0, :, 0]
        whole = whole if order else float(steps.min())
        chosen = left[first_least(steps, scale=whole)]
        order.append(chosen)
        subset, row = subset | 1 << chosen, between_m[chosen]
    return order


def subset_costs(missing: Floats, between_m: Floats, found: Floats, search: float, ends: Floats) -> Floats:
    """W(S, i) of one item type for every subset S of its candidates and every candidate i.

    Args:
        missing: shape (2**k,).
        between_m: shape (k, k).
        found: shape (k, targets).
        ends: W(all candidates, i), shape (k, targets).

    Returns:
        Shape (2**k, k, targets).
    """
    k = len(between_m)
    table = np.zeros((1 << k, k, found.shape[1]))
    table[-1] = ends
    for subset in range((1 << k) - 2, 0, -1):
        table[subset] = _min_over_next(missing, between_m, found, search, table, subset)
    return table


def _min_over_next(
    missing: Floats, from_m: Floats, found: Floats, search: float, table: Floats, subset: int
) -> Floats:
    """The right-hand side of the recursion for each row of from_m, shape (rows, targets)."""
    return _next_step_terms(missing, from_m, found, search, table, subset).min(axis=1)


def _next_step_terms(
    missing: Floats, from_m: Floats, found: Floats, search: float, table: Floats, subset: int
) -> Floats:
    """The terms that are minimised, for each next container a, shape (rows, candidates left, targets)."""
    left = np.array([a for a in range(from_m.shape[1]) if not subset >> a & 1], dtype=np.intp)
    after = subset | (1 << left)
    gain = missing[subset] - missing[after]
    onward = missing[subset] * search + gain[:, None] * found[left] + table[after, left]
    return missing[subset] * from_m[:, left, None] + onward
