"""The program of reference.py compiled with numba: equal results up to rounding, hundreds of times faster.

States are visited by their number of looks in all, so that only two layers of them are in memory, and a few targets
at a time, so that the two layers stay in the processor's cache. Import this module lazily, as search/compiled.py.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

import numpy as np
from numba import njit

from workbench.arrays import Floats, Ints
from workbench.tolerances import MIN_SCALE, RELATIVE

TILE = 8
"""Targets that are processed together."""

MIN_STATES_FOR_THREADS, MAX_THREADS = 2000, 8
"""From so many states on, item types are spread over threads; the compiled code releases the GIL."""

MATH = {"nnan", "ninf", "nsz"}
"""Fast-math flags as in search/compiled.py: results do not depend on the machine."""


def cost_table(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
) -> Floats:
    """W(nothing, origin) for every item type; arguments and result as in reference.cost_table."""
    answer = np.empty((from_m.shape[0], from_m.shape[1], found.shape[2]))
    states = _states(between_m.shape[1], looks)

    def part(these: slice) -> None:
        _cost_table(
            missing[these], between_m[these], from_m[these], found[these], float(search), looks, states, answer[these]
        )

    threads = min(os.cpu_count() or 1, MAX_THREADS) if missing.shape[1] >= MIN_STATES_FOR_THREADS else 1
    if threads == 1 or len(answer) < 2:
        part(slice(None))
        return answer
    each = -(-len(answer) // threads)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(part, [slice(first, first + each) for first in range(0, len(answer), each)]))
    return answer


def best_sequence(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
) -> list[int]:
    """The minimiser's sequence for one origin and target; arguments and answer as reference.best_sequence."""
    return [int(a) for a in _best_sequence(missing, between_m, from_m, found, float(search), looks)]


@lru_cache(maxsize=16)
def _states(k: int, looks: int) -> tuple[Ints, Ints, Ints, Ints]:
    """States by their looks in all: the states in that order, each one's place within its layer, where each layer
    starts, and the looks into each candidate, shape (states, k)."""
    base = looks + 1
    digits = np.arange(base**k)[:, None] // base ** np.arange(k) % base
    total = digits.sum(axis=1)
    order = np.argsort(total, kind="stable")
    start = np.concatenate([[0], np.bincount(total).cumsum()])
    position = np.empty(len(order), dtype=np.int64)
    position[order] = np.arange(len(order)) - start[total[order]]
    return order.astype(np.int64), position, start.astype(np.int64), np.ascontiguousarray(digits, dtype=np.int64)


@njit(cache=True, nogil=True, fastmath=MATH)
def _cost_table(
    missing: Floats,
    between_m: Floats,
    from_m: Floats,
    found: Floats,
    search: float,
    looks: int,
    states: tuple[Ints, Ints, Ints, Ints],
    answer: Floats,
) -> None:
    order, position, start, digits = states
    items, origins, k = from_m.shape
    targets = found.shape[2]
    largest = 0
    for size in range(len(start) - 1):
        largest = max(largest, start[size + 1] - start[size])
    width = min(targets, TILE)
    layer = np.zeros((2, largest, k, width))
    onward, reward, best = np.empty((k, width)), np.zeros((k, width)), np.empty(width)
    left = np.empty(k, np.int64)
    for item in range(items):
        for first in range(0, targets, width):
            tile = min(width, targets - first)
            for a in range(k):
                for g in range(tile):
                    reward[a, g] = found[item, a, first + g]
                for g in range(width):
                    layer[(k * looks) & 1, 0, a, g] = 0.0
            for size in range(k * looks - 1, -1, -1):
                here, next_size = size & 1, 1 - (size & 1)
                for place in range(start[size], start[size + 1]):
                    state = order[place]
                    r = missing[item, state]
                    count = 0
                    step = 1
                    for a in range(k):
                        if digits[state, a] < looks:
                            after = state + step
                            gain = r - missing[item, after]
                            later = layer[next_size, position[after], a]
                            for g in range(width):
                                onward[count, g] = r * search + gain * reward[a, g] + later[g]
                            left[count] = a
                            count += 1
                        step *= looks + 1
                    for i in range(k):
                        if digits[state, i]:
                            _least(layer[here, place - start[size], i], r, between_m[item, i], left, count, onward)
            for o in range(origins):
                _least(best, missing[item, 0], from_m[item, o], left, k, onward)
                for g in range(tile):
                    answer[item, o, first + g] = best[g]


@njit(cache=True, nogil=True, fastmath=MATH, inline="always")
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


@njit(cache=True, nogil=True)
def _best_sequence(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
) -> Ints:
    k, base = len(from_m), looks + 1
    table = np.zeros((len(missing), k))
    onward = np.empty(k)
    for state in range(len(missing) - 2, 0, -1):
        r = missing[state]
        step = 1
        for a in range(k):
            onward[a] = np.inf
            if state // step % base < looks:
                after = state + step
                onward[a] = r * search + (r - missing[after]) * found[a] + table[after, a]
            step *= base
        for i in range(k):
            table[state, i] = (r * between_m[i] + onward).min()
    sequence = np.empty(k * looks, np.int64)
    state, slack = 0, 0.0
    for stop in range(k * looks):
        r, step = missing[state], 1
        for a in range(k):
            onward[a] = np.inf
            if state // step % base < looks:
                leg = from_m[a] if stop == 0 else between_m[sequence[stop - 1], a]
                after = state + step
                onward[a] = r * (leg + search) + (r - missing[after]) * found[a] + table[after, a]
            step *= base
        least = onward.min()
        if stop == 0:
            slack = RELATIVE * max(MIN_SCALE, abs(least))
        chosen = 0
        while onward[chosen] > least + slack:
            chosen += 1
        sequence[stop] = chosen
        state += base**chosen
    return sequence
