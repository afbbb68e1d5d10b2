"""Local search for cheaper orders of containers under Eq. 1, compiled with numba.

The probability that the object is still missing depends on which stops came before, not on their order. So
rearranging a segment of an order changes nothing before it, and after it only the leg that follows: only the new
cost of the segment has to be summed, and the sum is abandoned once it exceeds the old one.

One recursion serves all belief models: the probability of ending at a stop is m p, with m the product of 1 - p over
the stops before (1 where places exclude one another), and what is still missing falls by that. It begins at 1, at
the probability that an instance exists (`exists`), or at the sum of p (`exclusive`); the cost is divided by that
beginning.

Moves: a segment is reversed, or a run of one to three stops is moved elsewhere (2-opt and or-opt, as for the
travelling repairman problem, of which this is the probabilistic form).

An order takes thousands of moves, each a short sum. Numba counts the references to every array that a loop takes out
of a named tuple and to all that a call is given, which took longer than the sums: so `_move_improves` takes them out
before its loop, and is inlined.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false, reportArgumentType=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel
from workbench.tolerances import RELATIVE

INDEPENDENT, EXISTS, EXCLUSIVE = 0, 1, 2
MODEL_NUMBERS = {"independent": INDEPENDENT, "exists": EXISTS, "exclusive": EXCLUSIVE, "marginal": EXISTS}

MAX_RUN_LENGTH = 3
MIN_GAIN = RELATIVE
"""A move must save this share of the cost, so that rounding cannot cause cycles."""

NEGLIGIBLE = 1e-3
"""Moves that start where less than this share of the cost remains are not tried."""


class TourQuery(NamedTuple):
    """One query as arrays.

    Attributes:
        p: remaining.unconditioned, shape (containers,); if an instance is assumed, some entry is above 0.
        model: number by MODEL_NUMBERS.
        from_m: from the origin to each container, shape (containers,).
        between_m: shape (containers, containers).
        found: R_pick + d(a, to), shape (containers,).
        look: R_search.
    """

    p: Floats
    model: int
    from_m: Floats
    between_m: Floats
    found: Floats
    look: float


class _PrefixSums(NamedTuple):
    """Prefix quantities of the current order, before each stop and after the last, shape (containers + 1,).

    miss: m. left: probability that the object is still missing, not yet divided by left[0]. upto: cost of the stops
    before, not yet divided by left[0].
    """

    miss: Floats
    left: Floats
    upto: Floats


@kernel()
def improve(start: Ints, query: TourQuery, passes: int) -> tuple[Ints, float]:
    """Improve an order by at most `passes` passes over all moves, accepting every move that helps.

    Args:
        start: indices of all containers, shape (containers,).

    Returns:
        An order that costs no more than the start, and its cost. More passes never cost more.
    """
    n = len(start)
    order, new = start.copy(), start.copy()
    now = _PrefixSums(np.ones(n + 1), np.ones(n + 1), np.zeros(n + 1))
    now.left[0] = _initial_missing(query)
    _fill_prefix_sums(order, query, now)
    for _ in range(passes):
        before = now.upto[n]
        for length in range(MAX_RUN_LENGTH + 1):
            for first in range(n - length + 1):
                if now.upto[n] - now.upto[first] <= NEGLIGIBLE * now.upto[n]:
                    break
                for to in range(n - max(length, 1) + 1):
                    if to == first or (length == 0 and to < first):
                        continue
                    low = min(first, to)
                    high = to if length == 0 else max(first, to) + length - 1
                    if _move_improves(order, first, length, to, low, high, query, now):
                        for j in range(low, high + 1):
                            new[j] = _stop_after_move(order, j, first, length, to)
                        for j in range(low, high + 1):
                            order[j] = new[j]
                        _fill_prefix_sums(order, query, now)
        if now.upto[n] >= before:
            break
    return order, now.upto[n] / now.left[0]


@kernel()
def _initial_missing(query: TourQuery) -> float:
    """The probability that the object is missing before the first stop, not normalised."""
    if query.model == INDEPENDENT:
        return 1.0
    total = 0.0
    for p in query.p:
        total += p if query.model == EXCLUSIVE else p * (1.0 - total)
    return total


@kernel()
def _fill_prefix_sums(order: Ints, query: TourQuery, now: _PrefixSums) -> None:
    """Fills `now` for an order."""
    for j in range(len(order)):
        a = order[j]
        leg = query.from_m[a] if j == 0 else query.between_m[order[j - 1], a]
        end = now.miss[j] * query.p[a]
        now.miss[j + 1] = now.miss[j] * (1.0 if query.model == EXCLUSIVE else 1.0 - query.p[a])
        now.left[j + 1] = max(now.left[j] - end, 0.0)
        now.upto[j + 1] = now.upto[j] + now.left[j] * (leg + query.look) + end * query.found[a]


@kernel(inline="always")
def _stop_after_move(order: Ints, place: int, first: int, length: int, to: int) -> int:
    """The container at a position of the segment that a move touches.

    length 0: the stops first..to are reversed. Otherwise the run of `length` stops at `first` goes to `to`.
    """
    if length == 0:
        return order[first + to - place]
    if to <= place < to + length:
        return order[first + place - to]
    return order[place - length] if to < first else order[place + length]


@kernel(forceinline=True)
def _move_improves(
    order: Ints, first: int, length: int, to: int, low: int, high: int, query: TourQuery, now: _PrefixSums
) -> bool:
    """Whether the stops low..high, including the leg that follows, cost less after the move."""
    n = len(order)
    p, between_m, found, look, model = query.p, query.between_m, query.found, query.look, query.model
    after = now.left[high + 1]
    most = now.upto[high + 1] - now.upto[low] - MIN_GAIN * now.upto[n]
    if high + 1 < n:
        last = _stop_after_move(order, high, first, length, to)
        most += after * (between_m[order[high], order[high + 1]] - between_m[last, order[high + 1]])
    cost, miss, left = 0.0, now.miss[low], now.left[low]
    at = order[low - 1] if low else 0
    for j in range(low, high + 1):
        a = _stop_after_move(order, j, first, length, to)
        leg = query.from_m[a] if j == 0 else between_m[at, a]
        end = miss * p[a]
        cost += left * (leg + look) + end * found[a]
        if cost >= most:
            return False
        left -= end
        if model != EXCLUSIVE:
            miss *= 1.0 - p[a]
        at = a
    return True
