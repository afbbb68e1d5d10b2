"""The two loops of boosted trees, compiled: walking rows through trees, and growing one tree on binned features.

The first call on a machine compiles for a few seconds and keeps the result beside this file, or in numba's own
cache where that cannot be written. Sums keep their order, so the same rows give the same trees and totals.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]
Bins = npt.NDArray[np.uint8]


BLOCK = 128
"""Rows that walk together: their steps do not wait for one another."""


@njit(cache=True, nogil=True)
def walk(
    rows: Floats, roots: Ints, depth: Ints, feature: Ints, threshold: Floats, child: Ints, value: Floats
) -> Floats:
    """The sum over trees of the leaf that each row comes to, shape (rows,). A step is an addition, not a branch."""
    count = len(rows)
    total, node = np.zeros(count), np.empty(BLOCK, np.int32)
    for first in range(0, count, BLOCK):
        some = min(BLOCK, count - first)
        for t in range(len(roots)):
            for i in range(some):
                node[i] = roots[t]
            for _ in range(depth[t]):
                for i in range(some):
                    k = node[i]
                    node[i] = child[k] + np.int32(rows[first + i, feature[k]] > threshold[k])
            for i in range(some):
                total[first + i] += value[node[i]]
    return total


@njit(cache=True)
def _histogram(
    binned: Bins, slope: Floats, curve: Floats, weight: Floats, rows: npt.NDArray[np.int64], columns: Ints, bins: int
) -> Floats:
    sums = np.zeros((len(columns), bins + 1, 3))
    for i in rows:
        for k in range(len(columns)):
            b = binned[i, columns[k]]
            sums[k, b, 0] += slope[i]
            sums[k, b, 1] += curve[i]
            sums[k, b, 2] += weight[i]
    return sums


@njit(cache=True)
def _best_split(sums: Floats, least: float, ridge: float) -> tuple[float, int, int]:
    """Gain, column and bin of the best split; the gain is 0 when none is allowed."""
    best, column, cut = 0.0, -1, -1
    for k in range(sums.shape[0]):
        g, h, w = sums[k, :, 0].sum(), sums[k, :, 1].sum(), sums[k, :, 2].sum()
        lg, lh, lw = 0.0, 0.0, 0.0
        whole = g * g / (h + ridge)
        for b in range(sums.shape[1] - 1):
            lg += sums[k, b, 0]
            lh += sums[k, b, 1]
            lw += sums[k, b, 2]
            if lw < least or w - lw < least:
                continue
            gain = lg * lg / (lh + ridge) + (g - lg) ** 2 / (h - lh + ridge) - whole
            if gain > best + 1e-12:
                best, column, cut = gain, k, b
    return best, column, cut


@njit(cache=True)
def grow(
    binned: Bins,
    slope: Floats,
    curve: Floats,
    weight: Floats,
    columns: Ints,
    leaves: int,
    depth: int,
    least: float,
    ridge: float,
    bins: int,
) -> tuple[Ints, Ints, Ints, Floats]:
    """One tree, leaf by leaf: feature (-1 for a leaf), bin, first child and value of its nodes."""
    nodes = 2 * leaves - 1
    feature, cut = np.full(nodes, -1, np.int32), np.zeros(nodes, np.int32)
    child, value = np.zeros(nodes, np.int32), np.zeros(nodes)
    level = np.zeros(nodes, np.int32)
    rows = [np.arange(len(slope))]
    sums = [_histogram(binned, slope, curve, weight, rows[0], columns, bins)]
    splits = [_best_split(sums[0], least, ridge)]
    value[0] = -slope.sum() / (curve.sum() + ridge)
    count = 1
    while count + 2 <= nodes:
        chosen, gain = -1, 0.0
        for k in range(count):
            if feature[k] < 0 and level[k] < depth and splits[k][0] > gain:
                chosen, gain = k, splits[k][0]
        if chosen < 0:
            break
        column, at = splits[chosen][1], splits[chosen][2]
        goes_left = binned[rows[chosen], columns[column]] <= at
        for side in range(2):
            mine = rows[chosen][goes_left] if side == 0 else rows[chosen][~goes_left]
            rows.append(mine)
            sums.append(_histogram(binned, slope, curve, weight, mine, columns, bins))
            splits.append(_best_split(sums[-1], least, ridge))
            level[count + side] = level[chosen] + 1
            value[count + side] = -slope[mine].sum() / (curve[mine].sum() + ridge)
        feature[chosen], cut[chosen] = columns[column], at
        child[chosen] = count
        count += 2
    return feature[:count], cut[:count], child[:count], value[:count]
