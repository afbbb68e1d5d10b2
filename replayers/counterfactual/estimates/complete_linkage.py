"""Merge distances of complete-linkage clustering, by nearest-neighbour chains.

A chain goes from each cluster to its nearest until two are nearest to each other; those merge. With complete linkage
that gives the same merges as always taking the closest pair (Murtagh, "Complexities of hierarchic clustering
algorithms", 1984; Muellner, "Modern hierarchical, agglomerative clustering algorithms", arXiv:1109.2378). Compiled
with numba. The same algorithm with the same ties as scipy.cluster.hierarchy.linkage, to which a test holds it.

Why not that function: its import takes 0.24 s of processor time beside numba and numpy (scipy 1.17; numba's own takes
0.18 s), at the start of every replay.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np

from workbench.arrays import Floats
from workbench.third_party.kernels import kernel


def merge_widths(apart: Floats) -> Floats:
    """The diameter of the cluster that each merge makes, ascending; float, shape (places - 1,).

    Args:
        apart: pairwise distances of at least one place: symmetric, finite, shape (places, places).
    """
    return np.sort(merged_widths(np.array(apart, dtype=np.float64)))


@kernel()
def merged_widths(apart: Floats) -> Floats:
    """The diameters in the order of the merges; overwrites the distances."""
    n = len(apart)
    widths = np.empty(n - 1)
    is_left = np.ones(n, dtype=np.bool_)
    chain = np.empty(n, dtype=np.int64)
    length = 0
    for merge in range(n - 1):
        if length == 0:
            chain[0] = 0
            while not is_left[chain[0]]:
                chain[0] += 1
            length = 1
        while True:
            at = chain[length - 1]
            nearest, least = -1, np.inf
            if length > 1:  # among equals, the previous cluster: otherwise the chain could cycle
                nearest = chain[length - 2]
                least = apart[at, nearest]
            for other in range(n):
                if is_left[other] and other != at and apart[at, other] < least:
                    nearest, least = other, apart[at, other]
            if length > 1 and nearest == chain[length - 2]:
                break
            chain[length] = nearest
            length += 1
        length -= 2
        gone, kept = min(at, nearest), max(at, nearest)
        widths[merge] = least
        is_left[gone] = False
        for other in range(n):
            if is_left[other] and other != kept:
                wider = max(apart[gone, other], apart[kept, other])
                apart[kept, other] = apart[other, kept] = wider
    return widths
