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

LEAF = -1
"""Stands for the feature of a node that is a leaf."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trees:
    """Binary trees, all nodes in one list; children stand after their parents.

    Attributes:
        roots: int32, shape (trees,), the first node of each.
        feature: int32, shape (nodes,), what a node asks about; LEAF for a leaf.
        threshold: float64, shape (nodes,): at most this goes left.
        left, right: int32, shape (nodes,), the nodes to go on with.
        value: float64, shape (nodes,), what a leaf adds.
    """

    roots: Ints
    feature: Ints
    threshold: Floats
    left: Ints
    right: Ints
    value: Floats

    def total(self, rows: Floats) -> Floats:
        """The sum over trees for rows of features, shape (rows,)."""
        from workbench.beliefs.compiled_trees import walk

        rows = np.ascontiguousarray(rows, dtype=np.float64)
        return walk(rows, self.roots, self.feature, self.threshold, self.left, self.right, self.value)


def trees_tensors(trees: Trees) -> dict[str, Tensor]:
    """What a weights file holds of trees."""
    return {
        "trees.roots": trees.roots,
        "trees.feature": trees.feature,
        "trees.threshold": trees.threshold.astype(np.float32),
        "trees.left": trees.left,
        "trees.right": trees.right,
        "trees.value": trees.value.astype(np.float32),
    }


def trees_from(weights: Weights, *, features: int) -> Trees:
    """The trees of a weights file; every walk in them ends. Raises MalformedFile."""
    roots = weights.tensor("trees.roots", None).astype(np.int32)
    feature = weights.tensor("trees.feature", None).astype(np.int32)
    n = len(feature)
    left, right = (weights.tensor(f"trees.{side}", n).astype(np.int32) for side in ("left", "right"))
    inner, order = feature != LEAF, np.arange(n)
    forward = all(((side[inner] > order[inner]) & (side[inner] < n)).all() for side in (left, right))
    known = ((feature >= LEAF) & (feature < features)).all()
    if not n or not forward or not known or (roots < 0).any() or (roots >= n).any():
        raise MalformedFile(weights.path, "its trees lead nowhere", "Train it again with lios train")
    return Trees(
        roots=roots,
        feature=feature,
        threshold=weights.tensor("trees.threshold", n).astype(np.float64),
        left=left,
        right=right,
        value=weights.tensor("trees.value", n).astype(np.float64),
    )
