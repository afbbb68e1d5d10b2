"""Tie-breaking among nearly equal costs: the first, in a fixed order, of all within a tolerance of the least.

Sums of the same numbers differ in their last bits with the order in which they were added, with the machine and with
the program (numpy, numba). A decision between equal costs must not depend on that. So every choice is made in two
steps: the least cost, then the first alternative that costs no more than that and the tolerance. "First" is by the
order in which the alternatives are given, which is a fixed one (the plan's order of containers, the order of ids).
Comparing with the best so far instead would let a chain of near-ties drift away from the least.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from math import isfinite
from typing import TypeVar

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.tolerances import MIN_SCALE, RELATIVE

T = TypeVar("T")


def tolerance(scale: float, *, min_scale: float = MIN_SCALE) -> float:
    """What two costs of that size may differ by and still be equal."""
    return RELATIVE * max(min_scale, abs(scale)) if isfinite(scale) else RELATIVE


def first_least(costs: Sequence[float] | Floats, *, scale: float | None = None) -> int:
    """The index of the first of all costs that are equal to the least.

    Args:
        costs: at least one, shape (n,); infinite ones are allowed.
        scale: the size of the whole cost of which these are parts; None takes the least cost.
    """
    values = np.asarray(costs, dtype=np.float64)
    least = float(values.min())
    return int(np.argmax(values <= least + tolerance(least if scale is None else scale)))


def first_of_least(things: Iterable[T], cost: Callable[[T], float]) -> T:
    """The first thing of all whose cost is equal to the least.

    Raises:
        ValueError: no things.
    """
    listed = list(things)
    return listed[0] if len(listed) == 1 else listed[first_least([cost(thing) for thing in listed])]


def by_cost(things: Iterable[T], cost: Callable[[T], float]) -> list[T]:
    """The things from the cheapest to the most expensive; equal ones in the order in which they are given."""
    listed = list(things)
    if len(listed) < 2:
        return listed
    costs = np.array([[cost(thing) for thing in listed]], dtype=np.float64)
    return [listed[int(i)] for i in ranked(-costs)[0]]


def ranked(scores: Floats, count: int | None = None, *, min_scale: float = MIN_SCALE) -> Indices:
    """Indices of the greatest scores of each row, greatest first; of equal ones the earlier.

    Args:
        scores: shape (rows, n).
        count: how many of each row; None for all.
        min_scale: the scale below which the tolerance shrinks no further; 0 where scores of any size differ.

    Returns:
        Shape (rows, min(count, n)).
    """
    if len(scores) == 1:  # a search asks for one before every look, and arrays of rows take four times as long
        return _ranked_row(scores[0], min_scale)[None, :count]
    order = np.argsort(-scores, axis=1, kind="stable")
    in_order = scores[np.arange(len(scores))[:, None], order]
    slack = RELATIVE * np.maximum(min_scale, np.abs(in_order[:, :-1]))
    with np.errstate(invalid="ignore"):  # infinite less infinite
        gap = in_order[:, :-1] - in_order[:, 1:]
    for row in np.flatnonzero(((gap > 0) & (gap <= slack)).any(axis=1)):
        order[row] = _ranked_one_by_one(scores[row], min_scale)
    return order if count is None else order[:, :count]


def _ranked_row(scores: Floats, min_scale: float) -> Indices:
    """The same of one row."""
    order = np.argsort(-scores, kind="stable")
    in_order = scores[order].tolist()
    if any(0 < a - b <= RELATIVE * max(min_scale, abs(a)) for a, b in pairwise(in_order)):
        return _ranked_one_by_one(scores, min_scale)
    return order


def _ranked_one_by_one(scores: Floats, min_scale: float) -> Indices:
    """The same of one row that has near-ties: always the first of all that are equal to the greatest left."""
    left = np.ones(len(scores), dtype=np.bool_)
    order = np.empty(len(scores), dtype=np.intp)
    for place in range(len(scores)):
        greatest = float(scores[left].max())
        order[place] = int(np.argmax(left & (scores >= greatest - tolerance(greatest, min_scale=min_scale))))
        left[order[place]] = False
    return order
