"""Distances on a grid to the nearest marked cell, and the largest connected part of a grid.

Both give what scipy.ndimage gives (`distance_transform_edt`, `label`), to which a test holds them. numpy alone does,
since the largest distance in a house is some dozens of cells.
"""

from __future__ import annotations

from math import inf

import numpy as np

from workbench.arrays import Bools, Floats, Ints


def distances_to(marked: Bools, *, within: float = inf) -> Floats:
    """The distance in cells from the centre of each cell to that of the nearest marked one, by two passes.

    Args:
        marked: bool, shape (rows, columns).
        within: distances up to this are exact, and larger ones only known to be larger, which saves time.

    Returns:
        The same shape; 0 at marked cells, inf everywhere if there are none.
    """
    squared = np.square(_within_columns(marked))
    best = squared.copy()
    columns = marked.shape[1]
    for shift in range(1, columns):
        if shift > within or shift * shift >= best.max():
            break
        np.minimum(best[:, shift:], squared[:, :-shift] + shift * shift, out=best[:, shift:])
        np.minimum(best[:, :-shift], squared[:, shift:] + shift * shift, out=best[:, :-shift])
    return np.sqrt(best)


def largest_part(free: Bools) -> Bools:
    """The largest 4-connected part of the free cells; of equally large ones, that of the first cell, row by row.

    Args:
        free: bool, shape (rows, columns).
    """
    rows, first, last = _runs(free)
    parent = list(range(len(rows)))

    def root(run: int) -> int:
        while parent[run] != run:
            parent[run] = parent[parent[run]]
            run = parent[run]
        return run

    above = below = 0
    row_of, starts, ends = rows.tolist(), first.tolist(), last.tolist()
    while below < len(row_of):
        if above == below or row_of[above] >= row_of[below]:
            below += 1
        elif row_of[above] + 1 < row_of[below] or ends[above] < starts[below]:
            above += 1
        elif ends[below] < starts[above]:
            below += 1
        else:
            a, b = root(above), root(below)
            parent[max(a, b)] = min(a, b)
            if ends[above] <= ends[below]:
                above += 1
            else:
                below += 1
    part = np.array([root(run) for run in range(len(rows))], dtype=np.int64)
    largest = np.zeros(free.shape, dtype=np.bool_)
    if len(part):
        sizes = np.bincount(part, weights=last - first + 1)
        for run in np.flatnonzero(part == int(sizes.argmax())):
            largest[rows[run], first[run] : last[run] + 1] = True
    return largest


def closed_gaps(marked: Bools, cells: int) -> Bools:
    """Marked cells with gaps of up to twice so many cells closed: dilated, then eroded, by crosses of 5 cells.

    Outside of the grid nothing is marked, so that what touches its border is worn off there.
    """
    grown = marked
    for _ in range(cells):
        grown = _crossed(grown, np.logical_or)
    for _ in range(cells):
        grown = _crossed(grown, np.logical_and)
    return grown


def _crossed(marked: Bools, join: np.ufunc) -> Bools:
    padded = np.pad(marked, 1)
    around = (padded[1:-1, 1:-1], padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:])
    return np.asarray(join.reduce(around), dtype=np.bool_)


def _within_columns(marked: Bools) -> Floats:
    """Distances in cells to the nearest marked cell of the same column, inf where there is none."""
    number = np.arange(len(marked), dtype=np.float64)[:, None]
    before = np.maximum.accumulate(np.where(marked, number, -np.inf), axis=0)
    after = np.minimum.accumulate(np.where(marked, number, np.inf)[::-1], axis=0)[::-1]
    return np.minimum(number - before, after - number)


def _runs(free: Bools) -> tuple[Ints, Ints, Ints]:
    """The row, first and last column of each run of free cells, row by row."""
    padded = np.pad(free, ((0, 0), (1, 1))).astype(np.int8)
    step = np.diff(padded, axis=1)
    rows, first = np.nonzero(step == 1)
    _, after = np.nonzero(step == -1)
    return rows.astype(np.int64), first.astype(np.int64), after.astype(np.int64) - 1
