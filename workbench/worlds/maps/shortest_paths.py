"""Shortest paths on an 8-connected grid by Dinitz's buckets: with steps of 1 and sqrt 2, no heap is needed.

Cells in the bucket [k, k + 1) cannot improve one another, because every step is at least 1 long: they are final
when the bucket's turn comes. 8-connected; a diagonal step needs both cells beside it free.
Compiled once by numba and kept beside this file (or in numba's cache folder where that is read-only).

Why not scipy.sparse.csgraph.dijkstra: over the 24 shipped houses it takes ten times as long for all pairs, the graph
included, and it adds the steps of a way in another order, so that six costs in ten differ in their last digits; what
is logged and cached would change with them.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Any, TypeVar, cast

import numba
import numpy as np

from workbench.arrays import Bools, Floats, Ints
from workbench.tolerances import ROUNDING

SQRT2 = sqrt(2.0)
DIRECTIONS = np.array([(0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)], dtype=np.int64)
_FREE = numba.types.Array(numba.boolean, 2, "C", readonly=True)
_CELLS = numba.types.Array(numba.int64, 1, "C", readonly=True)
Function = TypeVar("Function", bound=Callable[..., Any])


def _compiled(signature: Any) -> Callable[[Function], Function]:
    """Compile for one signature with caching; without a writable cache folder, compile in every process."""

    def decorate(function: Function) -> Function:
        try:
            return cast(Function, numba.njit(signature, cache=True)(function))
        except RuntimeError:
            return cast(Function, numba.njit(signature)(function))

    return decorate


@_compiled(numba.float64[::1](_FREE, numba.int64, _CELLS))
def distances_from(free: Bools, source: int, targets: Ints) -> Floats:
    """Distances in steps from a source cell to every cell, inf if unreached; stops once all targets are final.

    Args:
        free: bool, shape (rows, columns); its border must be False.
        source: flat index of a free cell.
        targets: flat indices; empty to reach every cell.
    """
    rows, columns = free.shape
    flat = free.reshape(-1)
    size = rows * columns
    distance = np.full(size, np.inf)
    queued = np.full(size, -1, dtype=np.int64)
    is_target = np.zeros(size, dtype=np.bool_)
    left = 0
    for target in targets:
        if not is_target[target]:
            is_target[target] = True
            left += 1
    stop_early = left > 0
    buckets, counts = np.empty((3, size), dtype=np.int64), np.zeros(3, dtype=np.int64)
    distance[source], queued[source] = 0.0, 0
    buckets[0, 0], counts[0] = source, 1
    turn = 0
    while counts[0] + counts[1] + counts[2] > 0:
        now = turn % 3
        for position in range(counts[now]):
            cell = buckets[now, position]
            if queued[cell] != turn:
                continue
            base = distance[cell]
            if is_target[cell]:
                is_target[cell] = False
                left -= 1
            for direction in range(8):
                step_row, step_column = DIRECTIONS[direction, 0], DIRECTIONS[direction, 1]
                other = cell + step_row * columns + step_column
                if not flat[other]:
                    continue
                length = 1.0
                if direction >= 4:
                    if not (flat[cell + step_row * columns] and flat[cell + step_column]):
                        continue
                    length = SQRT2
                longer = base + length
                if longer < distance[other] - ROUNDING:
                    distance[other] = longer
                    bucket = np.int64(longer + ROUNDING)
                    if queued[other] != bucket:
                        queued[other] = bucket
                        slot = bucket % 3
                        buckets[slot, counts[slot]] = other
                        counts[slot] += 1
        counts[now] = 0
        turn += 1
        if stop_early and left == 0:
            break
    return distance


@_compiled(numba.float64[:, ::1](_FREE, _CELLS))
def pairwise_steps(free: Bools, cells: Ints) -> Floats:
    """Distances in steps between all pairs of cells, shape (cells, cells), inf if there is no path."""
    count = len(cells)
    result = np.zeros((count, count))
    for i in range(count - 1):
        distance = distances_from(free, cells[i], cells[i + 1 :])
        for j in range(i + 1, count):
            result[i, j] = distance[cells[j]]
            result[j, i] = result[i, j]
    return result


def shortest_path(free: Bools, source: int, target: int) -> list[tuple[int, int]] | None:
    """The cells of a shortest path as (row, column), both ends included; None if there is none."""
    columns = free.shape[1]
    left = distances_from(free, target, np.array([source], dtype=np.int64))
    if not np.isfinite(left[source]):
        return None
    cell, heading = source, (0, 0)
    cells = [divmod(cell, columns)]
    while cell != target:
        step = _next_cell(free, left, cell, heading)
        heading = step
        cell += step[0] * columns + step[1]
        cells.append(divmod(cell, columns))
    return cells


def _next_cell(free: Bools, left: Floats, cell: int, heading: tuple[int, int]) -> tuple[int, int]:
    """The next cell of a shortest path, preferring the current direction."""
    columns = free.shape[1]
    row, column = divmod(cell, columns)
    best: tuple[float, bool, int] | None = None
    chosen = (0, 0)
    for index, (step_row, step_column) in enumerate(DIRECTIONS.tolist()):
        if not free[row + step_row, column + step_column]:
            continue
        diagonal = step_row != 0 and step_column != 0
        if diagonal and not (free[row + step_row, column] and free[row, column + step_column]):
            continue
        total = left[cell + step_row * columns + step_column] + (SQRT2 if diagonal else 1.0)
        rank = (round(float(total), 6), (step_row, step_column) != heading, index)
        if best is None or rank < best:
            best, chosen = rank, (step_row, step_column)
    return chosen
