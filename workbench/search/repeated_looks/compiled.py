"""The program of reference.py compiled with numba: equal results up to rounding, thousands of times faster.

States are visited from the greatest number to the least, digit by digit (to the base looks + 1) as a counter runs
down. W(n, i) is then needed only once more, by the state with one look fewer into i, before the next state with the
same lower digits overwrites it. So a row of targets for every candidate and its lower digits is all that is in
memory: for two looks into eight candidates half as many rows as states, in place of five times as many. Import this
module lazily, as search/compiled.py.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit

from workbench.arrays import Floats, Ints
from workbench.search.repeated_looks.lanes import LANES, TOGETHER, aligned, least, least_together, price
from workbench.tolerances import MIN_SCALE, RELATIVE

TILE = 40
"""Most targets that are processed together."""

MAX_ENTRIES = 8_000_000
"""Most entries of the rows in memory; fewer targets are processed together to stay below it."""

MIN_STATES_FOR_THREADS, MAX_THREADS = 2000, 8
"""From so many states on, item types are spread over threads; the compiled code releases the GIL."""

MATH = {"nnan", "ninf", "nsz"}
"""Fast-math flags as in search/compiled.py: results do not depend on the machine."""


def cost_table(
    missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
) -> Floats:
    """W(nothing, origin) for every item type; arguments and result as in reference.cost_table."""
    answer = np.empty((from_m.shape[0], from_m.shape[1], found.shape[2]))
    rows = sum((looks + 1) ** a for a in range(between_m.shape[1]))
    width = _width(found.shape[2], rows)

    def part(these: slice) -> None:
        _cost_table(
            missing[these], between_m[these], from_m[these], found[these], float(search), looks, width, answer[these]
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


def _width(targets: int, rows: int) -> int:
    """Targets that are processed together: equal shares, in whole registers."""
    tile = min(TILE, MAX_ENTRIES // rows // LANES * LANES)
    shares = -(-targets // max(LANES, tile))
    return -(-targets // (shares * LANES)) * LANES


@njit(cache=True, nogil=True, fastmath=MATH)
def _cost_table(
    missing: Floats,
    between_m: Floats,
    from_m: Floats,
    found: Floats,
    search: float,
    looks: int,
    width: int,
    answer: Floats,
) -> None:
    items, origins, k = from_m.shape
    targets = found.shape[2]
    power, start = np.ones(k + 1, np.int64), np.zeros(k + 1, np.int64)
    for a in range(k):
        power[a + 1] = power[a] * (looks + 1)
        start[a + 1] = start[a] + power[a]
    later, onward, reward, best = aligned(start[k], width), aligned(k, width), aligned(k, width), aligned(1, width)[0]
    digits, row, gain = np.empty(k, np.int64), np.empty(k, np.int64), np.empty(k)
    left, stood = np.empty(k, np.int64), np.empty(k, np.int64)
    for item in range(items):
        for first in range(0, targets, width):
            tile = min(width, targets - first)
            others = (0, k - 1)
            for a in range(k):
                digits[a] = looks
                row[a] = start[a] + power[a] - 1
                stood[max(0, a - 1)] = a
                for g in range(width):
                    later[start[a] + power[a] - 1, g] = 0.0
                for g in range(tile):
                    reward[a, g] = found[item, a, first + g]
            for state in range(power[k] - 2, -1, -1):
                count, places, others = _next_state(digits, row, left, stood, others, start, power, looks)
                r = missing[item, state]
                for c in range(count):
                    gain[c] = r - missing[item, state + power[left[c]]]
                price(onward, r * search, gain, reward, later, row, left, count)
                c = 0
                while c + TOGETHER <= places:
                    least_together(later, row, r, between_m[item], stood[c:], left, count, onward)
                    c += TOGETHER
                while c < places:
                    i = stood[c]
                    least(later[row[i]], r, between_m[item, i], left, count, onward)
                    c += 1
            for o in range(origins):
                least(best, missing[item, 0], from_m[item, o], left, k, onward)
                for g in range(tile):
                    answer[item, o, first + g] = best[g]


@njit(nogil=True, inline="always")
def _next_state(
    digits: Ints, row: Ints, left: Ints, stood: Ints, others: tuple[int, int], start: Ints, power: Ints, looks: int
) -> tuple[int, int, tuple[int, int]]:
    """Counts down to the next state; returns how many candidates have looks left, at how many
    the robot may stand, and `others` anew.

    They are listed, in left and stood, candidate 0 last; row says where each candidate's row begins.

    Args:
        others: how many of candidates other than 0 are in left and in stood.
    """
    in_left, in_stood = others
    if digits[0] > 0:  # only the lowest digit differs from that of the state before
        digits[0] -= 1
        for a in range(1, len(digits)):
            row[a] -= 1
    else:
        lowest = 0
        while digits[lowest] == 0:
            digits[lowest] = looks
            lowest += 1
        digits[lowest] -= 1
        lower = looks
        in_left = in_stood = 0
        for a in range(1, len(digits)):
            row[a] = start[a] + lower
            lower += digits[a] * power[a]
            left[in_left], stood[in_stood] = a, a
            in_left += digits[a] < looks
            in_stood += digits[a] > 0
    left[in_left], stood[in_stood] = 0, 0
    return in_left + (digits[0] < looks), in_stood + (digits[0] > 0), (in_left, in_stood)


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
