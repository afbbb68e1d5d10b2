"""Eq. 1 over states that count looks, in numpy: the readable reference for the compiled program.

A state is how often each candidate was looked into, n, and where the robot stands, i. With R(n) the probability that
the object is still missing (missing.py), and at most L looks into each candidate:

    W(n, i) = min over a with n_a < L of
              R(n) (d(i, a) + R_search) + (R(n) - R(n + a)) (R_pick + d(a, to)) + W(n + a, a)

with W = 0 when every candidate was looked into L times; the find cost is W(nothing, origin). With L = 1 this is the
recursion of workbench/search/reference.py.
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import Floats
from workbench.search.ties import first_least


def cost_table(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
) -> Floats:
    """W(nothing, origin) for every item type, origin and target.

    Args:
        missing: R(n), shape (item types, (looks + 1)**k); digit j of a state's number, to the base looks + 1, counts
            the looks into candidate j.
        between_m: d(i, a) between candidates, shape (item types, k, k).
        from_m: metres from each origin to each candidate, shape (item types, origins, k).
        found: R_pick + d(a, to), shape (item types, k, targets).
        search: R_search.
        looks: L.

    Returns:
        Shape (item types, origins, targets).
    """
    answer = np.empty((from_m.shape[0], from_m.shape[1], found.shape[2]))
    for item in range(len(answer)):
        table = _state_costs(missing[item], between_m[item], found[item], search, looks)
        answer[item] = _next_look_terms(missing[item], from_m[item], found[item], search, (looks, table, 0)).min(
            axis=1
        )
    return answer


def best_sequence(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
) -> list[int]:
    """The minimiser's sequence of looks from one origin to one target; of equal ones (ties.py) the earlier.

    Args:
        missing: shape ((looks + 1)**k,).
        between_m: shape (k, k).
        from_m, found: shape (k,).
    """
    k = len(from_m)
    table = _state_costs(missing, between_m, found[:, None], search, looks)
    sequence: list[int] = []
    state, row, whole = 0, from_m, 0.0
    while len(sequence) < k * looks:
        terms = _next_look_terms(missing, row[None], found[:, None], search, (looks, table, state))[0, :, 0]
        whole = whole if sequence else float(terms.min())
        chosen = _open(state, k, looks)[first_least(terms, scale=whole)]
        sequence.append(chosen)
        state, row = state + (looks + 1) ** chosen, between_m[chosen]
    return sequence


def _state_costs(missing: Floats, between_m: Floats, found: Floats, search: float, looks: int) -> Floats:
    """W(n, i) of one item type, shape (states, k, targets)."""
    k = len(between_m)
    table = np.zeros((len(missing), k, found.shape[1]))
    for state in range(len(missing) - 2, 0, -1):
        table[state] = _next_look_terms(missing, between_m, found, search, (looks, table, state)).min(axis=1)
    return table


def _next_look_terms(
    missing: Floats, from_m: Floats, found: Floats, search: float, at: tuple[int, Floats, int]
) -> Floats:
    """The terms that are minimised, for each next candidate, shape (rows of from_m, candidates open, targets)."""
    looks, table, state = at
    left = np.array(_open(state, from_m.shape[1], looks), dtype=np.intp)
    after = state + (looks + 1) ** left
    gain = missing[state] - missing[after]
    onward = missing[state] * search + gain[:, None] * found[left] + table[after, left]
    return missing[state] * from_m[:, left, None] + onward


def _open(state: int, k: int, looks: int) -> list[int]:
    """The candidates that may be looked into again."""
    return [a for a in range(k) if state // (looks + 1) ** a % (looks + 1) < looks]
