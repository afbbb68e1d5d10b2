"""What do boosted trees say of rows of features? The sum of one leaf a tree, walked in compiled code.

The walk is in `compiled_trees.py` and is imported when it is first needed: numba takes most of a second.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from workbench.beliefs.weights import Tensor, Weights
from workbench.errors import MalformedFile

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

ENDLESS = float(np.finfo(np.float32).max)
"""The threshold of a leaf: nothing is above it, so a leaf leads to itself."""

DEEPEST = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Trees:
    """Binary trees, all nodes in one list; the two children of a node stand side by side, after it.

    A leaf is its own child, so that every walk of a tree takes as many steps as the tree is deep and many rows can
    be walked at once.

    Attributes:
        roots: int32, shape (trees,), the first node of each, rising.
        depth: int32, shape (trees,), how many steps lead to the deepest leaf.
        feature: int32, shape (nodes,), what a node asks about; 0 for a leaf.
        threshold: float64, shape (nodes,): at most this goes to the first child, more to the second.
        child: int32, shape (nodes,), the first child; the node itself for a leaf.
        value: float64, shape (nodes,), what a leaf adds.
    """

    roots: Ints
    depth: Ints
    feature: Ints
    threshold: Floats
    child: Ints
    value: Floats

    def total(self, rows: Floats) -> Floats:
        """The sum over trees for rows of features, shape (rows,)."""
        from workbench.beliefs.compiled_trees import walk

        rows = np.ascontiguousarray(rows, dtype=np.float64)
        return walk(rows, self.roots, self.depth, self.feature, self.threshold, self.child, self.value)


def depths(roots: Ints, child: Ints) -> Ints:
    """How deep each tree is, shape (trees,)."""
    level = np.zeros(len(child), dtype=np.int32)
    for node in np.flatnonzero(child != np.arange(len(child))):
        level[child[node]] = level[child[node] + 1] = level[node] + 1
    ends = np.append(roots[1:], len(child))
    return np.array([level[a:b].max(initial=0) for a, b in zip(roots, ends, strict=True)], dtype=np.int32)


def trees_tensors(trees: Trees) -> dict[str, Tensor]:
    """What a weights file holds of trees."""
    return {
        "trees.roots": trees.roots,
        "trees.feature": trees.feature,
        "trees.threshold": trees.threshold.astype(np.float32),
        "trees.child": trees.child,
        "trees.value": trees.value.astype(np.float32),
    }


def trees_from(weights: Weights, *, features: int) -> Trees:
    """The trees of a weights file; every walk in them ends. Raises MalformedFile."""
    roots = weights.tensor("trees.roots", None).astype(np.int32)
    feature = weights.tensor("trees.feature", None).astype(np.int32)
    n = len(feature)
    child = weights.tensor("trees.child", n).astype(np.int32)
    own = np.arange(n)
    forward = ((child >= own) & (child < n)).all() and (child[child != own] < n - 1).all()
    known = ((feature >= 0) & (feature < features)).all()
    rising = len(roots) > 0 and roots[0] == 0 and (np.diff(roots) > 0).all() and roots[-1] < n
    if not n or not forward or not known or not rising or depths(roots, child).max() > DEEPEST:
        raise MalformedFile(weights.path, "its trees lead nowhere", "Train it again with lios train")
    return Trees(
        roots=roots,
        depth=depths(roots, child),
        feature=feature,
        threshold=weights.tensor("trees.threshold", n).astype(np.float64),
        child=child,
        value=weights.tensor("trees.value", n).astype(np.float64),
    )
