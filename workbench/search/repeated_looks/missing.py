"""The probability R(n) that an object is still missing after n looks into each container, where a look can miss.

With p the probability that a container holds the item type, q the chance that one look misses it there, and looks
that miss independently of one another, n looks into one container show nothing with the chance m(n) = 1 - p + p q^n.
As in remaining.py, over all containers U that may be searched:

    independent   R(n) = product of m(n)
    exists        R(n) = (product of m(n) - product over U of (1 - p)) / (1 - product over U of (1 - p))
    exclusive     R(n) = sum over U of p q^n / sum over U of p
    marginal      as exists, of z p for p

With q = 0 these are the probabilities of remaining.py. They are functions of the same two sums: what looks have shown
(inside), and what they have not (outside).
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.errors import BadValue
from workbench.search.find_costs import BeliefModel
from workbench.search.remaining import still_missing, unconditioned

MAX_LOOKS_COUNTED = 3
"""Most looks into one container that a state counts."""


def check_looks(looks: int) -> int:
    """The number of looks that are counted a container, if valid.

    Raises:
        BadValue: outside 1 to MAX_LOOKS_COUNTED.
    """
    if not 1 <= looks <= MAX_LOOKS_COUNTED:
        raise BadValue("looks into a container", looks, f"from 1 to {MAX_LOOKS_COUNTED}")
    return looks


def still_missing_by_counts(
    probability: Floats, candidates: Indices, miss: Floats, model: BeliefModel, counts: tuple[int, ...]
) -> Floats:
    """R of every state of look counts.

    Args:
        probability: shape (item types, containers), over all containers that may be searched.
        candidates: indices into the containers, shape (item types, k).
        miss: q, the chance that one look misses, shape (item types, containers).
        counts: how often each candidate may have been looked into, from 0: (0, 1, 2), or (0, 2) for twice at once.

    Returns:
        Shape (item types, len(counts)**k). Digit j of a state's number, to the base len(counts), is the place in
        `counts` of the looks into candidate j. Entry 0 of each is 1.
    """
    p = unconditioned(np.asarray(probability, dtype=np.float64), model)
    inside, outside = _shown_and_not(
        np.take_along_axis(p, candidates, axis=1)[:, :, None],
        np.take_along_axis(miss, candidates, axis=1)[:, :, None] ** np.array(counts),
        model,
    )
    others = _shown_and_not(p, np.ones_like(p), model)[1]
    np.put_along_axis(others, candidates, 0.0, axis=1)
    rest = others.sum(axis=1, keepdims=True)
    return still_missing(_sums(inside), _sums(outside) + rest, model)


def still_missing_along_looks(probability: Floats, order: Indices, miss: Floats, model: BeliefModel) -> Floats:
    """R after each prefix of a sequence of looks.

    Args:
        probability, miss: shape (containers,).
        order: indices of containers, which may come again, shape (looks,).

    Returns:
        Shape (looks + 1,), the first entry 1.
    """
    p = unconditioned(np.asarray(probability, dtype=np.float64), model)
    made = (np.asarray(order)[:, None] == np.arange(len(p))).cumsum(axis=0)
    made = np.concatenate([np.zeros((1, len(p)), dtype=made.dtype), made])
    inside, outside = _shown_and_not(p[None], miss[None] ** made, model)
    return still_missing(inside.sum(axis=1), outside.sum(axis=1), model)


def _shown_and_not(p: Floats, unseen: Floats, model: BeliefModel) -> tuple[Floats, Floats]:
    """The two parts of remaining.weights after looks that miss with chance `unseen` in all: what they have shown and
    what they have not."""
    if model == "exclusive":
        return p * (1.0 - unseen), p * unseen
    empty = 1.0 - p * (1.0 - unseen)
    with np.errstate(divide="ignore"):
        share = np.divide(
            p * unseen, empty, out=np.zeros(np.broadcast_shapes(p.shape, unseen.shape)), where=empty > 0
        )
        return np.log1p(-p * (1.0 - unseen)), np.log1p(-share)


def _sums(of_candidates: Floats) -> Floats:
    """Sums over the candidates for every state, from shape (item types, k, counts)."""
    items, k, base = of_candidates.shape
    sums = np.zeros((items, 1))
    for j in range(k):
        sums = (of_candidates[:, j, :, None] + sums[:, None, :]).reshape(items, base * sums.shape[1])
    return sums
