"""The two inner loops of boosted trees, compiled with numba: evaluating trees on rows, and growing one tree.

The first call on a machine compiles for a few seconds and keeps the result beside this file, or in numba's own
cache where that cannot be written. Sums keep their order, so the same rows give the same trees and totals.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np

from workbench.arrays import Floats, Ints32, Uints8
from workbench.third_party.kernels import kernel

BLOCK = 256
"""Rows evaluated together: their features fit into the second-level cache."""

MIN_GAIN = 1e-9
"""Minimum improvement of a split, so that rounding never decides."""


@kernel()
def walk(columns: Floats, feature: Ints32, threshold: Floats, value: Floats) -> Floats:
    """The sum of leaf values over all trees for each row, shape (rows,)."""
    count = columns.shape[1]
    trees, depth = feature.shape
    total, leaf = np.zeros(count), np.empty(BLOCK, np.int32)
    for first in range(0, count, BLOCK):
        some = min(BLOCK, count - first)
        for t in range(trees):
            leaf[:some] = 0
            for level in range(depth):
                x = columns[feature[t, level], first : first + some]
                above, bit = threshold[t, level], np.int32(1 << level)
                for i in range(some):
                    leaf[i] += bit * np.int32(x[i] > above)
            for i in range(some):
                total[first + i] += value[t, leaf[i]]
    return total


@kernel()
def grow(
    binned: Uints8, slope: Floats, curve: Floats, columns: Ints32, depth: int, ridge: float, bins: int
) -> tuple[Ints32, Ints32, Floats]:
    """Grow one tree level by level; returns the feature and bin of each level and the value of each leaf.

    Args:
        binned: shape (rows, features); a level tests whether the bin exceeds a threshold.
        slope, curve: gradient and curvature of the loss, shape (rows,).
        columns: features available to this tree.
    """
    leaf = np.zeros(len(slope), np.int32)
    feature, cut = np.zeros(depth, np.int32), np.zeros(depth, np.int32)
    for level in range(depth):
        sums = _sums(binned, slope, curve, columns, leaf, 1 << level, bins)
        column, at = _best_split(sums, ridge)
        feature[level], cut[level] = columns[column], at
        bit = np.int32(1 << level)
        for i in range(len(leaf)):
            leaf[i] += bit * np.int32(binned[i, columns[column]] > at)
    g, h = np.zeros(1 << depth), np.zeros(1 << depth)
    for i in range(len(leaf)):
        g[leaf[i]] += slope[i]
        h[leaf[i]] += curve[i]
    return feature, cut, -g / (h + ridge)


@kernel()
def _sums(
    binned: Uints8, slope: Floats, curve: Floats, columns: Ints32, leaf: Ints32, leaves: int, bins: int
) -> Floats:
    """Sums of gradient and curvature by column, leaf and bin, shape (columns, leaves, bins, 2)."""
    sums = np.zeros((len(columns), leaves, bins, 2))
    for i in range(len(slope)):
        for k in range(len(columns)):
            b = binned[i, columns[k]]
            sums[k, leaf[i], b, 0] += slope[i]
            sums[k, leaf[i], b, 1] += curve[i]
    return sums


@kernel()
def _best_split(sums: Floats, ridge: float) -> tuple[int, int]:
    """The column and bin that split all leaves of a level best."""
    best, column, cut = -1.0, 0, 0
    bins = sums.shape[2]
    for k in range(sums.shape[0]):
        fit = np.zeros(bins)
        for leaf in range(sums.shape[1]):
            g, h = sums[k, leaf, :, 0].sum(), sums[k, leaf, :, 1].sum()
            below_g, below_h = 0.0, 0.0
            for b in range(bins):
                below_g += sums[k, leaf, b, 0]
                below_h += sums[k, leaf, b, 1]
                fit[b] += below_g * below_g / (below_h + ridge)
                fit[b] += (g - below_g) ** 2 / (max(h - below_h, 0.0) + ridge)
        for b in range(bins):
            if fit[b] > best + MIN_GAIN:
                best, column, cut = fit[b], k, b
    return column, cut
