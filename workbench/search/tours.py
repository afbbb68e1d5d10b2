"""What does an order of containers cost, and which small changes make it cheaper? Compiled local search.

The chance that the object is still missing depends on which stops came before, not on their order. So when a
stretch of an order is rearranged, nothing changes before it, and after it only the way there: the new cost of
the stretch is all that has to be summed, and the sum is given up once it exceeds the old one.

Within an order that chance is a product of 1 - p over the stops before, and, where an instance is known to exist,
the chance that one of the later stops holds it, summed from the last stop backwards: no difference of nearly equal
numbers is ever formed.

Changes: a stretch is turned round, or a run of one to three stops is moved elsewhere (2-opt and or-opt, as for the
travelling repairman problem, of which this is the probabilistic form).
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false, reportArgumentType=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

INDEPENDENT, EXISTS, EXCLUSIVE = 0, 1, 2
MODEL_NUMBERS = {"independent": INDEPENDENT, "exists": EXISTS, "exclusive": EXCLUSIVE}

LONGEST_RUN = 3
LEAST_GAIN = 1e-9
"""A change must save this share of the cost, so that rounding never makes two orders take turns."""


class Search(NamedTuple):
    """One query in arrays.

    Attributes:
        p: shape (containers,); where an instance is known to exist, some entry is above 0.
        model: of MODEL_NUMBERS.
        from_m: from the origin to each container, shape (containers,).
        between_m: shape (containers, containers).
        found: R_pick + d(a, to), shape (containers,).
        look: R_search.
    """

    p: Array
    model: int
    from_m: Array
    between_m: Array
    found: Array
    look: float


class _Along(NamedTuple):
    """Of the present order, before each stop and after the last, shape (containers + 1,).

    miss: product of 1 - p over the stops before; 1 where places exclude one another.
    later: chance that this or a later stop holds an instance; 1 where none is known to exist.
    upto: cost of the stops before, not yet divided by later[0].
    fresh: `later` of a change under trial.
    """

    miss: Array
    later: Array
    upto: Array
    fresh: Array


@njit(cache=True, nogil=True)
def improve(start: Indices, query: Search, passes: int) -> tuple[Indices, float]:
    """An order after at most `passes` passes over all small changes, each taking every change that helps.

    Args:
        start: indices of all containers, shape (containers,).

    Returns:
        An order that costs no more than the start, and its cost. More passes never cost more.
    """
    n = len(start)
    order, trial = start.copy(), start.copy()
    now = _Along(np.ones(n + 1), np.ones(n + 1), np.zeros(n + 1), np.ones(n + 1))
    _measure(order, query, now)
    for _ in range(passes):
        before = now.upto[n]
        for length in range(LONGEST_RUN + 1):
            for first in range(n - length + 1):
                for to in range(n):
                    low, high = _change(order, trial, first, length, to)
                    if high <= low:
                        continue
                    if _helps(trial, order, low, high, query, now):
                        for j in range(low, high + 1):
                            order[j] = trial[j]
                        _measure(order, query, now)
                    else:
                        for j in range(low, high + 1):
                            trial[j] = order[j]
        if now.upto[n] >= before:
            break
    return order, now.upto[n] / now.later[0]


@njit(cache=True, nogil=True)
def _measure(order: Indices, query: Search, now: _Along) -> None:
    """Fills `now` for an order."""
    n = len(order)
    now.later[n] = 1.0 if query.model == INDEPENDENT else 0.0
    for j in range(n - 1, -1, -1):
        now.later[j] = _joined(query.p[order[j]], now.later[j + 1], query.model)
    for j in range(n):
        a = order[j]
        leg = query.from_m[a] if j == 0 else query.between_m[order[j - 1], a]
        before = now.miss[j] * now.later[j]
        now.miss[j + 1] = now.miss[j] * (1.0 if query.model == EXCLUSIVE else 1.0 - query.p[a])
        after = now.miss[j + 1] * now.later[j + 1]
        now.upto[j + 1] = now.upto[j] + before * (leg + query.look) + (before - after) * query.found[a]


@njit(cache=True, nogil=True)
def _joined(p: float, later: float, model: int) -> float:
    """The chance that this stop or a later one holds an instance."""
    if model == INDEPENDENT:
        return 1.0
    if model == EXCLUSIVE:
        return p + later
    return p + (1.0 - p) * later


@njit(cache=True, nogil=True)
def _helps(trial: Indices, order: Indices, low: int, high: int, query: Search, now: _Along) -> bool:
    """Whether the stops low..high of `trial` cost less than those of `order`, the leg that follows included."""
    n = len(order)
    after = now.miss[high + 1] * now.later[high + 1]
    leg = query.between_m[order[high], order[high + 1]] if high + 1 < n else 0.0
    most = now.upto[high + 1] - now.upto[low] + after * leg - LEAST_GAIN * now.upto[n]
    now.fresh[high + 1] = now.later[high + 1]
    for j in range(high, low - 1, -1):
        now.fresh[j] = _joined(query.p[trial[j]], now.fresh[j + 1], query.model)
    cost = 0.0
    miss = now.miss[low]
    for j in range(low, high + 1):
        a = trial[j]
        leg = query.from_m[a] if j == 0 else query.between_m[trial[j - 1], a]
        before = miss * now.fresh[j]
        miss *= 1.0 if query.model == EXCLUSIVE else 1.0 - query.p[a]
        left = miss * now.fresh[j + 1]
        cost += before * (leg + query.look) + (before - left) * query.found[a]
        if cost >= most:
            return False
    leg = query.between_m[trial[high], trial[high + 1]] if high + 1 < n else 0.0
    return cost + after * leg < most


@njit(cache=True, nogil=True)
def _change(order: Indices, trial: Indices, first: int, length: int, to: int) -> tuple[int, int]:
    """Writes one small change into `trial`, which equals `order`; returns the first and last stop that it touches.

    length 0: the stops first..to are turned round. Otherwise the run of `length` stops at `first` goes to place
    `to`. (0, 0) is no change.
    """
    n = len(order)
    if length == 0:
        if to <= first or first >= n:
            return 0, 0
        for j in range(to - first + 1):
            trial[first + j] = order[to - j]
        return first, to
    if to == first or to + length > n:
        return 0, 0
    if to < first:
        for j in range(to, first):
            trial[j + length] = order[j]
    else:
        for j in range(first + length, to + length):
            trial[j - length] = order[j]
    for j in range(length):
        trial[to + j] = order[first + j]
    return min(first, to), max(first, to) + length - 1
