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

from workbench.arrays import Floats, Ints, Uints64
from workbench.search.repeated_looks.simd import LANES, TOGETHER, aligned, least, least_together, price
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, RELATIVE

TILE = 40
"""Most targets that are processed together."""

MAX_ENTRIES = 8_000_000
"""Most entries of the rows in memory; fewer targets are processed together to stay below it."""

MIN_STATES_FOR_THREADS, MAX_THREADS = 2000, 8
"""From so many states on, item types are spread over threads; the compiled code releases the GIL."""

MATH = {"nnan", "ninf", "nsz"}
"""Fast-math flags as in search/compiled.py: results do not depend on the machine."""

ONE = np.uint64(1)


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


@kernel(fastmath=MATH)
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
    power, start = _numbering(k, looks)
    rows = np.int64(start[k])
    later, onward, reward, best = aligned(rows, width), aligned(k, width), aligned(k, width), aligned(1, width)[0]
    digits, row, gain = np.empty(k, np.uint64), np.empty(k, np.uint64), np.empty(k)
    left, stood = np.empty(k + 1, np.uint64), np.empty(k + 1, np.uint64)
    for item in range(items):
        still = missing[item]
        for first in range(0, targets, width):
            tile = min(width, targets - first)
            digits[:] = looks
            for a in range(k):
                later[start[a] + power[a] - ONE] = 0.0
                for g in range(tile):
                    reward[a, g] = found[item, a, first + g]
            for state in range(len(still) - 2, -1, -1):
                count, places = _next_state(digits, row, left, stood, start, power, looks)
                r = still[state]
                for c in range(np.uint64(count)):
                    gain[c] = max(r - still[np.uint64(state) + power[left[c]]], 0.0)
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
                least(best, still[0], from_m[item, o], left, k, onward)
                for g in range(tile):
                    answer[item, o, first + g] = best[g]


@njit(nogil=True)
def _numbering(k: int, looks: int) -> tuple[Uints64, Uints64]:
    """What one look into each candidate adds to a state's number, and where the rows of each start."""
    power, start = np.ones(k + 1, np.uint64), np.zeros(k + 1, np.uint64)
    for a in range(k):
        power[a + 1] = power[a] * np.uint64(looks + 1)
        start[a + 1] = start[a] + power[a]
    return power, start


@njit(nogil=True, inline="always")
def _next_state(
    digits: Uints64, row: Uints64, left: Uints64, stood: Uints64, start: Uints64, power: Uints64, looks: int
) -> tuple[int, int]:
    """Counts down to the next state; returns how many candidates have looks left, and at how many the robot may
    stand. They are listed in left and stood, which have one entry to spare; row says where each one's row begins.

    All arrays are unsigned: numba then spares the check for negative indices, a tenth of the whole time.
    """
    lowest, most = np.uint64(0), np.uint64(looks)
    while digits[lowest] == 0:
        digits[lowest] = most
        lowest += ONE
    digits[lowest] -= ONE
    lower = in_left = in_stood = np.uint64(0)
    for a in range(np.uint64(len(digits))):
        row[a] = start[a] + lower
        lower += digits[a] * power[a]
        left[in_left], stood[in_stood] = a, a
        in_left += np.uint64(digits[a] < most)
        in_stood += np.uint64(digits[a] > 0)
    return np.int64(in_left), np.int64(in_stood)  # pyright: ignore[reportReturnType]


@kernel()
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
