"""The probability R(n) that an object is still missing after n looks into each container, where a look can miss.

With p the probability that a container holds the item type, q the chance that one look misses it there, and looks
that miss independently of one another, n looks into one container show nothing with the chance m(n) = 1 - p + p q^n.
As in remaining.py, over all containers U that may be searched:

    independent   R(n) = product of m(n)
    exists        R(n) = (product of m(n) - product over U of (1 - p)) / (1 - product over U of (1 - p))
    exclusive     R(n) = sum over U of p q^n / sum over U of p
    marginal      as exists, of z p for p

With q = 0 these are the probabilities of remaining.py. No nearly equal numbers are subtracted: what `exists` weighs
is the product of m(n) times the chance that the item is somewhere nevertheless, which is put together from the
chances of single containers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.errors import BadValue
from workbench.search.find_costs import BeliefModel
from workbench.search.remaining import KINDS, compiled_loops, unconditioned

Combine = Callable[[Floats, Floats], Floats]

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
    shown, hidden = _outcomes(
        np.take_along_axis(p, candidates, axis=1)[:, :, None],
        np.take_along_axis(miss, candidates, axis=1)[:, :, None] ** np.array(counts),
        model,
    )
    others = p.copy()
    np.put_along_axis(others, candidates, 0.0, axis=1)
    with_shown, with_hidden = _rules(model)
    rest = reduce(with_hidden, others.T)
    loops = compiled_loops()
    if loops is not None:
        return loops.missing_by_counts(shown, hidden, rest, KINDS[model])
    rest = rest[:, None]
    return _still_missing(_of_states(shown, with_shown), with_hidden(_of_states(hidden, with_hidden), rest), model)


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
    shown, hidden = _outcomes(p[None], miss[None] ** made, model)
    with_shown, with_hidden = _rules(model)
    return _still_missing(reduce(with_shown, shown.T)[None], reduce(with_hidden, hidden.T)[None], model)[0]


def _outcomes(p: Floats, unseen: Floats, model: BeliefModel) -> tuple[Floats, Floats]:
    """Of single containers, after looks that miss with chance `unseen` in all: the chance that they show nothing, and
    the chance that they hold the item nevertheless. For `exclusive` the weights of the item being seen and not."""
    if model == "exclusive":
        return p * (1.0 - unseen), p * unseen
    empty = 1.0 - p * (1.0 - unseen)
    there = np.divide(p * unseen, empty, out=np.zeros(np.broadcast_shapes(p.shape, unseen.shape)), where=empty > 0)
    return empty, there


def _rules(model: BeliefModel) -> tuple[Combine, Combine]:
    """How the two parts of _outcomes are put together from those of single containers."""
    return (np.add, np.add) if model == "exclusive" else (np.multiply, _either)


def _either(a: Floats, b: Floats) -> Floats:
    """The chance of one of two independent events."""
    return a + b * (1.0 - a)


def _of_states(of_candidates: Floats, combine: Combine) -> Floats:
    """The candidates' values put together for every state, from shape (item types, k, counts)."""
    made, *others = np.moveaxis(of_candidates, 1, 0)
    for each in others:
        made = combine(made[:, None, :], each[:, :, None]).reshape(len(made), -1)
    return made


def _still_missing(shown: Floats, hidden: Floats, model: BeliefModel) -> Floats:
    """R from what _rules puts together, along the last axis, whose first entry is before any look."""
    if model == "independent":
        return shown
    if model == "exclusive":
        return hidden / (shown + hidden)
    return shown * hidden / hidden[..., :1]
