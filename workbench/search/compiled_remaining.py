"""Inner loops of remaining.py, candidates.py and corrected.py, compiled with numba.

They compute the probability of any instance, the probability that the object is missing after every subset, the
candidates, and the order of containers beyond them. A search needs them before every look, where numpy's many small
steps took longer than the dynamic program itself. Import this module lazily, like compiled.py.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from math import exp, expm1, log1p

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, NEWTON_STEP, RELATIVE

INDEPENDENT, EXISTS, EXCLUSIVE = 0, 1, 2
"""The formula of R, as in remaining.still_missing; marginal uses that of exists."""

MAX_NEWTON_STEPS = 60


@kernel(error_model="numpy")
def chance_of_any(p: Floats) -> Floats:
    """z of remaining._chance_of_any, by rows: shape (rows, containers) -> (rows, 1)."""
    answer = np.empty((len(p), 1))
    for row in range(len(p)):
        z = 1.0
        for _ in range(MAX_NEWTON_STEPS):
            log_miss, slope = 0.0, 0.0
            for a in p[row]:
                log_miss += log1p(-a * z)
                slope += a / (1.0 - a * z)
            miss = exp(log_miss)
            step = (1.0 - miss - z) / (miss * slope - 1.0)
            if not np.isfinite(step):
                break
            z = max(z - step, 0.0)
            if abs(step) < NEWTON_STEP:
                break
        answer[row, 0] = z
    return answer


@kernel(error_model="numpy")
def unconditioned(p: Floats, uniform: float, least: float) -> Floats:
    """remaining.unconditioned of the marginal model, shape (rows, containers).

    Args:
        uniform: the value of p of a row where every p is 0.
        least: the least value of z.
    """
    answer = np.empty(p.shape)
    for row in range(len(p)):
        nowhere = True
        for a in range(p.shape[1]):
            nowhere &= not p[row, a] > 0
        for a in range(p.shape[1]):
            answer[row, a] = uniform if nowhere else p[row, a]
        z = max(chance_of_any(answer[row : row + 1])[0, 0], least)
        for a in range(p.shape[1]):
            answer[row, a] *= z
    return answer


@kernel(error_model="numpy")
def greatest(scores: Floats, count: int) -> Indices:
    """The `count` columns of the greatest scores of each row, in their order; of equal ones (ties.py) the earlier.

    Args:
        scores: finite, shape (rows, columns).
    """
    rows, columns = scores.shape
    chosen = np.empty((rows, count), np.intp)
    is_left = np.empty(columns, np.bool_)
    for row in range(rows):
        is_left[:] = True
        for _ in range(count):
            most = -np.inf
            for a in range(columns):
                if is_left[a]:
                    most = max(most, scores[row, a])
            least, first = most - RELATIVE * max(MIN_SCALE, abs(most)), 0
            while not is_left[first] or scores[row, first] < least:
                first += 1
            is_left[first] = False
        place = 0
        for a in range(columns):
            if not is_left[a]:
                chosen[row, place] = a
                place += 1
    return chosen


@kernel(error_model="numpy")
def missing_by_counts(shown: Floats, hidden: Floats, rest: Floats, kind: int) -> Floats:
    """R(n) of repeated_looks.missing from its _outcomes, shape (item types, k, counts), and the part of `hidden` of
    the other containers, shape (item types,): shape (item types, counts**k)."""
    items, k, counts = shown.shape
    answer = np.empty((items, counts**k))
    inside, outside = np.empty(counts**k), np.empty(counts**k)
    for item in range(items):
        inside[0], outside[0], size = 0.0 if kind == EXCLUSIVE else 1.0, rest[item], 1
        for j in range(k):
            for count in range(counts - 1, -1, -1):
                a, b = shown[item, j, count], hidden[item, j, count]
                for n in range(size):
                    if kind == EXCLUSIVE:
                        inside[count * size + n], outside[count * size + n] = inside[n] + a, outside[n] + b
                    else:
                        inside[count * size + n] = inside[n] * a
                        outside[count * size + n] = b + outside[n] * (1.0 - b)
            size *= counts
        for n in range(size):
            if kind == INDEPENDENT:
                answer[item, n] = inside[n]
            elif kind == EXCLUSIVE:
                answer[item, n] = outside[n] / (inside[n] + outside[n])
            else:
                answer[item, n] = inside[n] * outside[n] / outside[0]
    return answer


@kernel(error_model="numpy")
def missing_by_subset(weights: Floats, candidates: Indices, kind: int) -> Floats:
    """R(S) of remaining.still_missing_by_subset from remaining.weights: shape (item types, 2**k)."""
    items, k = candidates.shape
    n = 1 << k
    answer, inside = np.empty((items, n)), np.zeros(n)
    chosen = np.zeros(weights.shape[1], np.bool_)
    for item in range(items):
        chosen[:] = False
        for j in range(k):
            chosen[candidates[item, j]] = True
            for subset in range(1 << j):
                inside[subset | 1 << j] = inside[subset] + weights[item, candidates[item, j]]
        others = 0.0
        for a in range(weights.shape[1]):
            if not chosen[a]:
                others += weights[item, a]
        for subset in range(n):
            within, without = inside[subset], inside[n - 1 - subset] + others
            if kind == INDEPENDENT:
                answer[item, subset] = exp(within)
            elif kind == EXCLUSIVE:
                answer[item, subset] = without / (within + without)
            else:
                answer[item, subset] = exp(within) * abs(expm1(without) / expm1(within + without))
    return answer


@kernel(error_model="numpy")
def non_candidate_order(p: Floats, searched: Indices, from_m: Floats, between_m: Floats) -> Indices:
    """corrected.non_candidate_order given the mean distance from the candidates, shape (item types, containers)."""
    items, n = p.shape
    left = n - searched.shape[1]
    order = np.empty((items, left), np.intp)
    is_left, worth = np.empty(n, np.bool_), np.empty(n)
    for item in range(items):
        is_left[:] = True
        slack = 0.0
        for a in range(n):
            slack = max(slack, RELATIVE * p[item, a])
        for j in searched[item]:
            is_left[j] = False
        last = -1
        for stop in range(left):
            best, chosen = -1.0, 0
            for a in range(n):
                if is_left[a]:
                    worth[a] = p[item, a] / (1.0 + (from_m[item, a] if last < 0 else between_m[last, a]))
                    best = max(best, worth[a])
            while not is_left[chosen] or worth[chosen] < best - slack:
                chosen += 1
            order[item, stop] = chosen
            is_left[chosen] = False
            last = chosen
    return order
