"""Oblivious boosted trees, and their evaluation on rows of features.

The trees are oblivious (Kohavi 1994; Prokhorenkova et al. 2018): all nodes of a level share one test, so that the
outcomes of a tree's tests are the bits of the leaf index. No nodes are traversed, and rows are evaluated in blocks.

The evaluation is in `compiled_trees.py`, which is imported lazily: importing numba takes most of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import AnyArray, Floats, Ints32
from workbench.beliefs.weights import Weights
from workbench.errors import MalformedFile

MAX_DEPTH = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Trees:
    """Oblivious trees of one depth.

    Attributes:
        feature: int32, shape (trees, depth): the feature that each level tests.
        threshold: float64, shape (trees, depth): a larger value sets the level's bit in the leaf index.
        value: float64, shape (trees, 2**depth), the value of each leaf.
    """

    feature: Ints32
    threshold: Floats
    value: Floats

    def total(self, columns: Floats) -> Floats:
        """The sum over trees, shape (rows,), of features by column: shape (features, rows)."""
        from workbench.beliefs.boosted_trees.compiled_trees import walk

        columns = np.ascontiguousarray(columns, dtype=np.float64)
        return walk(columns, self.feature, self.threshold, self.value)


def joined(trees: Sequence[Trees]) -> Trees:
    """Concatenate trees of equal depth."""
    return Trees(
        feature=np.concatenate([t.feature for t in trees]),
        threshold=np.concatenate([t.threshold for t in trees]),
        value=np.concatenate([t.value for t in trees]),
    )


def trees_tensors(trees: Trees) -> dict[str, AnyArray]:
    """The tensors of a weights file."""
    return {
        "trees.feature": trees.feature,
        "trees.threshold": trees.threshold.astype(np.float32),
        "trees.value": trees.value.astype(np.float32),
    }


def trees_from(weights: Weights, *, features: int) -> Trees:
    """The trees of a weights file. Raises MalformedFile."""
    feature = weights.tensor("trees.feature", None, None).astype(np.int32)
    count, depth = feature.shape
    known = ((feature >= 0) & (feature < features)).all()
    if not count or not 1 <= depth <= MAX_DEPTH or not known:
        raise MalformedFile(
            weights.path, "its trees use features that do not exist", "Train it again with lios train"
        )
    return Trees(
        feature=feature,
        threshold=weights.tensor("trees.threshold", count, depth).astype(np.float64),
        value=weights.tensor("trees.value", count, 1 << depth).astype(np.float64),
    )
