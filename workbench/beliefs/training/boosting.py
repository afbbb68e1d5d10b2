"""Histogram gradient boosting (Friedman 2001; Ke et al. 2017) of a log loss and a ranking loss.

Each tree is fitted to the gradient of two losses: the cross entropy of every (item, container) pair, which
calibrates the probabilities, and the softmax cross entropy over the containers of one item, which ranks the holder
first. Trees grow level by level (trees.py), on binned features.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.arrays import Floats, Ints, Ints32, Uints8
from workbench.beliefs.boosted_trees.compiled_trees import grow
from workbench.beliefs.boosted_trees.trees import Trees, joined

NO_SPLIT_THRESHOLD = float(np.finfo(np.float32).max)
"""The threshold of an unused level: no feature exceeds it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Boosting:
    """Hyperparameters of boosting; the defaults were chosen by cross-validation over the training houses.

    Attributes:
        trees: maximum number of trees.
        patience: number of trees without a better held-out loss after which training stops.
        rate: learning rate.
        depth: depth of a tree.
        ridge: L2 regularisation, added to the curvature of a leaf.
        columns: share of the features available to each tree.
        ranking: weight of the ranking loss beside the cross entropy.
        bins: number of bins of each feature.
    """

    trees: int = 300
    patience: int = 60
    rate: float = 0.075
    depth: int = 5
    ridge: float = 5.0
    columns: float = 0.5
    ranking: float = 0.3
    bins: int = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """The training data.

    Attributes:
        features: float64, shape (features, rows).
        start: log-odds before the first tree, shape (rows,).
        held: 0 or 1, shape (rows,).
        weight: shape (rows,).
        query: int64, shape (rows,): group of each row; rows of a group are ranked against each other; 0, 1, ...
            in order.
    """

    features: Floats
    start: Floats
    held: Floats
    weight: Floats
    query: Ints


def boost(
    rows: Rows,
    held_out: Rows,
    *,
    rng: np.random.Generator,
    how: Boosting,
    watch: Callable[[int, float], None] | None = None,
) -> Trees:
    """Grow trees, and keep those up to the minimum of the held-out cross entropy."""
    edges = [_edges(column, how.bins) for column in rows.features]
    binned = np.stack([np.searchsorted(e, x, side="left") for e, x in zip(edges, rows.features, strict=True)], axis=1)
    binned = np.ascontiguousarray(binned.astype(np.uint8))
    score, tested = rows.start.copy(), held_out.start.copy()
    grown: list[Trees] = []
    best, best_loss = 0, cross_entropy(tested, held_out)
    wanted = max(1, round(how.columns * binned.shape[1]))
    for number in range(how.trees):
        columns = np.sort(rng.permutation(binned.shape[1])[:wanted]).astype(np.int32)
        slope, curve = _gradient(score, rows, how.ranking)
        tree = _tree(binned, slope, curve, columns, edges, how)
        score += tree.total(rows.features)
        tested += tree.total(held_out.features)
        grown.append(tree)
        loss = cross_entropy(tested, held_out)
        if loss < best_loss:
            best, best_loss = number + 1, loss
        if watch:
            watch(number, loss)
        if number + 1 - best >= how.patience:
            break
    return joined(grown[: max(best, 1)])


def cross_entropy(score: Floats, rows: Rows) -> float:
    """Weighted mean of the cross entropy of log-odds."""
    loss = np.logaddexp(0.0, score) - rows.held * score
    return float((loss * rows.weight).sum() / rows.weight.sum())


def _gradient(score: Floats, rows: Rows, ranking: float) -> tuple[Floats, Floats]:
    """Gradient and curvature of the two losses, each of shape (rows,)."""
    p = 1.0 / (1.0 + np.exp(-np.clip(score, -30, 30)))
    count = int(rows.query.max()) + 1
    top = np.full(count, -np.inf)
    np.maximum.at(top, rows.query, score)
    e = np.exp(score - top[rows.query])
    share = e / np.bincount(rows.query, e, minlength=count)[rows.query]
    holders = np.bincount(rows.query, rows.held, minlength=count)
    wanted = rows.held / np.maximum(holders, 1.0)[rows.query]
    ranked = (holders > 0)[rows.query] * ranking
    slope = p - rows.held + ranked * (share - wanted)
    curve = p * (1 - p) + ranked * share * (1 - share)
    return slope * rows.weight, np.maximum(curve * rows.weight, 1e-9)


def _edges(column: Floats, bins: int) -> Floats:
    """Candidate thresholds of a feature: at most bins - 1 quantiles."""
    values = np.unique(column)
    if len(values) > bins:
        values = np.unique(np.quantile(column, np.linspace(0, 1, bins + 1)[1:-1], method="nearest"))
    else:
        values = values[:-1]
    # Midpoints rounded to float32, the precision of the weights file, so that trained and loaded trees split
    # equally.
    return np.unique(values.astype(np.float32).astype(np.float64))


def _tree(binned: Uints8, slope: Floats, curve: Floats, columns: Ints32, edges: list[Floats], how: Boosting) -> Trees:
    feature, cut, value = grow(binned, slope, curve, columns, how.depth, how.ridge, how.bins)
    threshold = [edges[f][c] if c < len(edges[f]) else NO_SPLIT_THRESHOLD for f, c in zip(feature, cut, strict=True)]
    return Trees(
        feature=feature[None],
        threshold=np.array([threshold], dtype=np.float64),
        value=(value * how.rate).astype(np.float32).astype(np.float64)[None],
    )
