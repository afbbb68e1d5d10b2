"""The baseline: Eq. 1 for one (item type, origin, target) by branch and bound over orders, compiled.

Depth first over the candidates that are left, the cheapest next step first; a branch is given up once its cost so
far reaches the best whole order's, as in the search planners that the paper builds on (Stein et al., 2018).
Never cached on disk: a cached function that calls itself crashes when it is loaded again.

`sharp` adds to the cost so far what at least remains: the object is missing with chance R, and finding it takes at
least the least leg to any candidate left and the least way from one to the target. A table needs one call a triple.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]


@njit(nogil=True)
def least_cost(p: Array, from_m: Array, between_m: Array, found: Array, search: float, sharp: bool) -> float:
    """The least expected cost over all orders; belief model independent.

    Args:
        p, from_m, found: shape (k,).
        between_m: shape (k, k).
    """
    k = len(p)
    best = np.array([np.inf])
    used = np.zeros(k, np.bool_)
    _branch(p, from_m, between_m, found, search, sharp, used, -1, 0, 0.0, 1.0, best)
    return best[0]


@njit(nogil=True)
def _branch(p, from_m, between_m, found, search, sharp, used, at, depth, cost, missing, best) -> None:  # type: ignore[no-untyped-def]
    k = len(p)
    if depth == k:
        best[0] = min(best[0], cost)
        return
    steps = np.empty(k)
    for a in range(k):
        leg = from_m[a] if at < 0 else between_m[at, a]
        steps[a] = np.inf if used[a] else missing * (leg + search + p[a] * found[a])
    if sharp and cost + _at_least(p, from_m, between_m, found, search, used, at, missing) >= best[0]:
        return
    for _ in range(k - depth):
        a = np.argmin(steps)
        total = cost + steps[a]
        if total >= best[0]:
            return
        steps[a] = np.inf
        used[a] = True
        _branch(p, from_m, between_m, found, search, sharp, used, a, depth + 1, total, missing * (1 - p[a]), best)
        used[a] = False


@njit(nogil=True)
def _at_least(p, from_m, between_m, found, search, used, at, missing) -> float:  # type: ignore[no-untyped-def]
    """A bound from below on what remains: one leg and look now, and the find wherever it is cheapest."""
    leg, least_found, miss = np.inf, np.inf, 1.0
    for a in range(len(p)):
        if not used[a]:
            leg = min(leg, from_m[a] if at < 0 else between_m[at, a])
            least_found = min(least_found, found[a])
            miss *= 1 - p[a]
    return missing * (leg + search + (1 - miss) * least_found)


def table(p: Array, from_m: Array, between_m: Array, found: Array, search: float, *, sharp: bool = False) -> Array:
    """The whole table, triple by triple.

    Args:
        p: shape (item types, k).
        from_m: shape (item types, origins, k).
        between_m: shape (item types, k, k).
        found: shape (item types, k, targets).
    """
    answer = np.empty((len(p), from_m.shape[1], found.shape[2]))
    for item, origin, target in np.ndindex(answer.shape):
        answer[item, origin, target] = least_cost(
            p[item], from_m[item, origin], between_m[item], found[item, :, target].copy(), search, sharp
        )
    return answer
