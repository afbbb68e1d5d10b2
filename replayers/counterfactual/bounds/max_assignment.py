"""Maximum-weight assignment of rows to columns.

The assignment problem, solved by shortest augmenting paths (Crouse, "On Implementing 2D Rectangular Assignment
Algorithms", IEEE Trans. Aerospace and Electronic Systems 52, 2016), compiled with numba. The same algorithm with the
same ties as scipy.optimize.linear_sum_assignment, to which a test holds it.

Why not that function: its import takes 0.30 s of processor time beside numba and numpy (scipy 1.17; numba's own takes
0.18 s), which is longer than most replays need for all their assignments.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel


@kernel()
def max_assignment(worth: Floats) -> Ints:
    """The column of each row, -1 for none, with as many pairs as the shorter side has; shape (rows,).

    Args:
        worth: weights, finite, shape (rows, columns).
    """
    rows, columns = worth.shape
    wide = rows <= columns
    cost = np.empty((rows, columns) if wide else (columns, rows))
    for row in range(rows):
        for column in range(columns):
            cost[(row, column) if wide else (column, row)] = -worth[row, column]
    chosen = _column_of_each_row(cost)
    if wide:
        return chosen
    column_of = np.full(rows, -1)
    for column in range(columns):
        column_of[chosen[column]] = column
    return column_of


@kernel()
def _column_of_each_row(cost: Floats) -> Ints:
    """The cheapest column for every row, each column used at most once; needs no more rows than columns."""
    rows, columns = cost.shape
    row_dual, column_dual = np.zeros(rows), np.zeros(columns)
    column_of = np.full(rows, -1, dtype=np.int64)
    row_of = np.full(columns, -1, dtype=np.int64)
    came_from = np.full(columns, -1, dtype=np.int64)
    shortest = np.empty(columns)
    left = np.empty(columns, dtype=np.int64)
    row_met = np.empty(rows, dtype=np.bool_)
    column_met = np.empty(columns, dtype=np.bool_)
    for new in range(rows):
        row_met[:] = False
        column_met[:] = False
        shortest[:] = np.inf
        for k in range(columns):
            left[k] = columns - 1 - k
        count, row, sink, length = columns, new, -1, 0.0
        while sink < 0:
            row_met[row] = True
            nearest, lowest = 0, np.inf
            for k in range(count):
                column = left[k]
                way = length + cost[row, column] - row_dual[row] - column_dual[column]
                if way < shortest[column]:
                    came_from[column] = row
                    shortest[column] = way
                # Among equals, prefer a column that ends the path.
                if shortest[column] < lowest or (shortest[column] == lowest and row_of[column] < 0):
                    lowest = shortest[column]
                    nearest = k
            length = lowest
            column = left[nearest]
            column_met[column] = True
            count -= 1
            left[nearest] = left[count]
            if row_of[column] < 0:
                sink = column
            else:
                row = row_of[column]
        row_dual[new] += length
        for other in range(rows):
            if row_met[other] and other != new:
                row_dual[other] += length - shortest[column_of[other]]
        for column in range(columns):
            if column_met[column]:
                column_dual[column] -= length - shortest[column]
        column, row = sink, -1
        while row != new:
            row = came_from[column]
            row_of[column] = row
            before = column_of[row]
            column_of[row] = column
            column = before
    return column_of
