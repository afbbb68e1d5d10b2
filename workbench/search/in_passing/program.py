"""Eq. 1 for a robot that sees in passing, by dynamic programming over what is known and where the robot stands.

On the way towards a candidate a, the robot learns what each open candidate c holds once c comes into view. With S
what it knows, and R(S) the probability that the object is still missing, the path costs

    sum over its parts of  R(S) (metres of this part) + (R(S) - R(S + c)) (metres to c + R_pick + d(c, to))

and S grows by c. The robot stops where a has come into view; if a must be opened, it looks into a at the end, for
R_search. From there it goes on towards the next candidate, the one of least cost.

It stands at the origin, or at the stop on the way from one place to the next, and goes on from there by the metres
from that stop. What it then sees is taken from the path that begins at the nearer end of the last one: exact where
the stop is the end, and an estimate otherwise. At every stop the robot decides again, by the paths from there.
"""

# pyright: reportMissingTypeStubs=false
from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from workbench.arrays import Floats, Indices


class SightLegs(NamedTuple):
    """The paths between k candidates and from the origin, which is place k.

    Attributes:
        metres: from each place to each candidate, shape (k + 1, k).
        seen: the candidates that come into view on each path, in order, -1 after the last, shape (k + 1, k, k).
        along_m: the metres before each does, of the same shape.
        on_m: the metres from there to it, of the same shape.
        until_m: the metres to where the robot stops, shape (k + 1, k): all of the path, if its end must be opened.
        onward_m: from there to every candidate, shape (k + 1, k, k).
    """

    metres: Floats
    seen: Indices
    along_m: Floats
    on_m: Floats
    until_m: Floats
    onward_m: Floats


def first_costs(missing: Floats, legs: SightLegs, found: Floats, search: float) -> Floats:
    """The expected cost of going to each candidate first, shape (k,).

    Args:
        missing: R(S), shape (2**k,).
        found: R_pick + d(a, to), shape (k,).
        search: R_search.
    """
    return _program()(missing, legs, found, float(search))


@cache
def _program() -> Callable[[Floats, SightLegs, Floats, float], Floats]:
    """The loops compiled, or as they are where numba cannot be imported."""
    try:
        from workbench.third_party.kernels import kernel
    except ImportError:
        return loops
    return kernel()(loops)


def loops(missing: Floats, legs: SightLegs, found: Floats, search: float) -> Floats:
    k = len(found)
    table, costs = np.zeros((1 << k, k + 1, k)), np.zeros(k)
    for known in range((1 << k) - 1, -1, -1):
        for begun in range(k + 1):
            for end in range(k):
                at_origin = known == 0
                stopped = begun != end and known >> end & 1
                if not stopped and not (at_origin and begun == k and end == 0):
                    continue
                walked = 0.0 if at_origin else legs.until_m[begun, end]
                left = 0.0 if at_origin else legs.metres[begun, end] - walked
                least = np.inf
                for a in range(k):
                    if known >> a & 1:
                        continue
                    over_start = walked + legs.metres[begun, a]
                    over_end = np.inf if at_origin else left + legs.metres[end, a]
                    place = end if over_end <= over_start else begun
                    here = legs.metres[k, a] if at_origin else legs.onward_m[begun, end, a]
                    before = here - legs.metres[place, a]
                    now, at, cost = known, 0.0, 0.0
                    for event in range(k):
                        c, along = legs.seen[place, a, event], legs.along_m[place, a, event]
                        if c < 0:
                            break
                        if now >> c & 1:
                            continue
                        along += before
                        if along < at:
                            if c != a and along < 0:
                                continue
                            along = at
                        gain = missing[now] - missing[now | 1 << c]
                        cost += missing[now] * (along - at) + gain * (legs.on_m[place, a, event] + found[c])
                        now, at = now | 1 << c, along
                        if c == a:
                            break
                    if not now >> a & 1:
                        gain = missing[now] - missing[now | 1 << a]
                        cost += missing[now] * (here - at + search) + gain * found[a]
                        now |= 1 << a
                    cost += table[now, place, a]
                    least = min(least, cost)
                    if at_origin:
                        costs[a] = cost
                if least < np.inf:
                    table[known, begun, end] = least
    return costs
