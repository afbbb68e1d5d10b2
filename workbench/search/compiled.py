"""The dynamic program of reference.py compiled with numba: equal results up to rounding, hundreds of times faster.

The inner loop runs over the targets, which share all but one term; subsets are visited by size, so that only two
layers of them are in memory. The first call on a machine compiles for a few seconds and keeps the result beside
this file, or in numba's own cache where that cannot be written. Import this module lazily: importing numba takes
most of a second.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, RELATIVE

TILE = 64
"""Targets that are processed together."""

MAX_ENTRIES = 8_000_000
"""Most entries of the two layers in memory; tiles are narrowed to stay below it."""

MIN_CANDIDATES_FOR_THREADS, MAX_THREADS = 11, 8
"""From so many candidates on, item types are spread over threads; the compiled code releases the GIL."""

MATH = {"nnan", "ninf", "nsz"}
"""Fast-math flags. No entry is NaN or infinite; the order of sums is kept, so results do not depend on the machine.
"""


def cost_table(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, tail: Floats | None = None
) -> Floats:
    """W(nothing, origin) for every item type; arguments and result as in reference.cost_table."""
    answer = np.empty((from_m.shape[0], from_m.shape[1], found.shape[2]))
    ends = np.zeros_like(found) if tail is None else tail
    layers = subset_layers(between_m.shape[1])

    def part(these: slice) -> None:
        fill_cost_table(
            missing[these],
            between_m[these],
            from_m[these],
            found[these],
            ends[these],
            float(search),
            layers,
            answer[these],
        )

    items = len(answer)
    threads = min(os.cpu_count() or 1, MAX_THREADS) if between_m.shape[1] >= MIN_CANDIDATES_FOR_THREADS else 1
    if threads == 1:
        part(slice(None))
        return answer
    each = -(-items // threads)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(part, [slice(first, first + each) for first in range(0, items, each)]))
    return answer


def best_order(missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float) -> list[int]:
    """The minimiser's order for one origin and target; arguments and answer as reference.best_order."""
    return [int(a) for a in search_order(missing, between_m, from_m, found, float(search))]


def pair_costs(
    missing: Floats,
    sets: Ints,
    between_m: Floats,
    from_m: Floats,
    found: Floats,
    search: float,
    start: Ints,
    pairs: Ints,
) -> Floats:
    """W(nothing, origin) of pairs of an origin and a target; arguments and answer as reference.pair_costs."""
    layers = subset_layers(sets.shape[1])
    return _pair_costs(missing, sets, between_m, from_m, found, float(search), (start, pairs), layers)


@kernel()
def subset_layers(k: int) -> tuple[Ints, Ints, Ints]:
    """Subsets by size: all subsets in that order, each one's place within its size, where each size starts."""
    n = 1 << k
    size = np.zeros(n, np.int64)
    position = np.zeros(n, np.int64)
    filled = np.zeros(k + 1, np.int64)
    for subset in range(n):
        size[subset] = size[subset >> 1] + (subset & 1)
        position[subset] = filled[size[subset]]
        filled[size[subset]] += 1
    start = np.zeros(k + 2, np.int64)
    for s in range(k + 1):
        start[s + 1] = start[s] + filled[s]
    order = np.empty(n, np.int64)
    for subset in range(n):
        order[start[size[subset]] + position[subset]] = subset
    return order, position, start


@kernel(fastmath=MATH)
def fill_cost_table(
    missing: Floats,
    between_m: Floats,
    from_m: Floats,
    found: Floats,
    ends: Floats,
    search: float,
    layers: tuple[Ints, Ints, Ints],
    answer: Floats,
) -> None:
    order, position, start = layers
    items, origins, k = from_m.shape
    targets = found.shape[2]
    largest = 0
    for size in range(k + 1):
        largest = max(largest, start[size + 1] - start[size])
    width = min(targets, TILE, max(4, MAX_ENTRIES // (2 * largest * k)))
    layer = np.zeros((2, largest, k, width))
    onward = np.empty((k, width))
    best = np.empty(width)
    reward = np.zeros((k, width))
    left = np.empty(k, np.int64)
    for item in range(items):
        for first in range(0, targets, width):
            tile = min(width, targets - first)
            for a in range(k):
                for g in range(tile):
                    reward[a, g] = found[item, a, first + g]
                    layer[k & 1, 0, a, g] = ends[item, a, first + g]
            for size in range(k - 1, -1, -1):
                here, next_size = size & 1, 1 - (size & 1)
                for place in range(start[size], start[size + 1]):
                    subset = order[place]
                    r = missing[item, subset]
                    count = 0
                    for a in range(k):
                        if not subset >> a & 1:
                            after = subset | (1 << a)
                            gain = r - missing[item, after]
                            later = layer[next_size, position[after], a]
                            for g in range(width):
                                onward[count, g] = r * search + gain * reward[a, g] + later[g]
                            left[count] = a
                            count += 1
                    for i in range(k):
                        if subset >> i & 1:
                            _least(best, r, between_m[item, i], left, count, onward)
                            for g in range(width):
                                layer[here, place - start[size], i, g] = best[g]
            for o in range(origins):
                _least(best, missing[item, 0], from_m[item, o], left, k, onward)
                for g in range(tile):
                    answer[item, o, first + g] = best[g]


@kernel(fastmath=MATH)
def _pair_costs(
    missing: Floats,
    sets: Ints,
    between_m: Floats,
    from_m: Floats,
    found: Floats,
    search: float,
    groups: tuple[Ints, Ints],
    layers: tuple[Ints, Ints, Ints],
) -> Floats:
    start, pairs = groups
    answer = np.empty(len(pairs))
    origins, k, targets = len(from_m), sets.shape[1], found.shape[1]
    column = np.empty(targets, np.int64)
    legs, from_origin = np.empty((1, k, k)), np.empty((1, origins, k))
    for u in range(len(sets)):
        column[:] = -1
        width = 0
        for pair in range(start[u], start[u + 1]):
            if column[pairs[pair, 1]] < 0:
                column[pairs[pair, 1]] = width
                width += 1
        ends = np.empty((1, k, width))
        for i in range(k):
            for j in range(k):
                legs[0, i, j] = between_m[sets[u, i], sets[u, j]]
            for o in range(origins):
                from_origin[0, o, i] = from_m[o, sets[u, i]]
            for g in range(targets):
                if column[g] >= 0:
                    ends[0, i, column[g]] = found[sets[u, i], g]
        table = np.empty((1, origins, width))
        here = missing[u : u + 1]
        fill_cost_table(here, legs, from_origin, ends, np.zeros_like(ends), search, layers, table)
        for pair in range(start[u], start[u + 1]):
            answer[pair] = table[0, pairs[pair, 0], column[pairs[pair, 1]]]
    return answer


@kernel(fastmath=MATH, inline="always")
def _least(best: Floats, r: float, metres: Floats, left: Ints, count: int, onward: Floats) -> None:
    """best[g] = min over the candidates left of r d + onward; two at a time, so that best is written less often."""
    width = len(best)
    j = 2 - (count & 1)
    leg, leg_2 = r * metres[left[0]], r * metres[left[j - 1]]
    for g in range(width):
        best[g] = min(leg + onward[0, g], leg_2 + onward[j - 1, g])
    while j < count:
        leg, leg_2 = r * metres[left[j]], r * metres[left[j + 1]]
        for g in range(width):
            best[g] = min(best[g], min(leg + onward[j, g], leg_2 + onward[j + 1, g]))
        j += 2


@kernel(fastmath=MATH)
def search_order(missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float) -> Ints:
    k = len(from_m)
    n = 1 << k
    table = np.zeros((n, k))
    into = np.empty((k, k))  # transposed: the inner loop runs over where the robot is
    for a in range(k):
        for i in range(k):
            into[a, i] = between_m[i, a]
    for subset in range(n - 2, 0, -1):
        r, first = missing[subset], True
        for a in range(k):
            if not subset >> a & 1:
                after = subset | (1 << a)
                onward = r * search + (r - missing[after]) * found[a] + table[after, a]
                if first:
                    for i in range(k):
                        table[subset, i] = r * into[a, i] + onward
                else:
                    for i in range(k):
                        table[subset, i] = min(table[subset, i], r * into[a, i] + onward)
                first = False
    order = np.empty(k, np.int64)
    costs = np.empty(k)
    subset, slack = 0, 0.0
    for stop in range(k):
        r, best, some = missing[subset], 0.0, False
        for a in range(k):
            if not subset >> a & 1:
                after = subset | (1 << a)
                leg = from_m[a] if stop == 0 else between_m[order[stop - 1], a]
                costs[a] = r * (leg + search) + (r - missing[after]) * found[a] + table[after, a]
                best, some = (min(best, costs[a]) if some else costs[a]), True
        if stop == 0:
            slack = RELATIVE * max(MIN_SCALE, abs(best))
        chosen = 0
        while subset >> chosen & 1 or costs[chosen] > best + slack:
            chosen += 1
        order[stop] = chosen
        subset |= 1 << chosen
    return order
