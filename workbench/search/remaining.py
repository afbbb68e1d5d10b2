"""The probability R(S) that an object is still missing after a set S of containers has been searched, by belief
model.

R(S) is the only quantity in which belief models differ. With p the probability of finding the item type in each
container and all containers U still unsearched:

    independent   R(S) = product over S of (1 - p)
    exists        R(S) = (product over S - product over U of (1 - p)) / (1 - product over U)
    exclusive     R(S) = sum over U \\ S of p / sum over U of p
    marginal      as exists, of z p for p, with z such that z = 1 - product over U of (1 - z p)

`exists` is `independent` conditioned on an instance being in at least one container of U; `exclusive` knows one
instance, whose places exclude one another. `marginal` is conditioned like `exists`, but takes p as the
probabilities *after* conditioning, which is what an estimator learns from houses that hold the item: before
conditioning they are z p, where z is the probability of any instance at all. Where the p add up to 1 or less, z is
0 and `marginal` is `exclusive`. Where every p is 0 the last three take their common limit for small equal p: every
container is as likely as any other.

All three are functions of a sum over S and a sum over the others, so nearly equal numbers are never subtracted:
probabilities of 1e-12 and of 1 are handled accurately.

The computations needed before every look are compiled (compiled_remaining.py); the numpy versions here are the
readable reference, and the fallback if numba cannot be imported.
"""

from __future__ import annotations

from functools import cache
from types import ModuleType

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.errors import BadValue
from workbench.search.find_costs import BeliefModel
from workbench.tolerances import NEWTON_STEP

UNIFORM_PROBABILITY = 1e-12
"""Value of p used if every p is 0 and an instance is known to exist."""

MIN_EXISTENCE_PROBABILITY = 1e-9
"""Value of z used in place of 0; the model is then practically exclusive."""

KINDS: dict[BeliefModel, int] = {"independent": 0, "exists": 1, "exclusive": 2, "marginal": 1}
"""The formula of R, as a number for compiled_remaining.py."""

BELIEF_MODELS: tuple[BeliefModel, ...] = ("independent", "exists", "exclusive", "marginal")


def weights(probability: Floats, model: BeliefModel) -> Floats:
    """The quantity summed over containers: log(1 - p), with z p in place of p for marginal; p for exclusive.

    Args:
        probability: shape (..., containers), over all unsearched containers.

    Raises:
        BadValue: an unknown belief model, or an entry that is not a probability.
    """
    p = np.asarray(probability, dtype=np.float64)
    if model not in BELIEF_MODELS:
        raise BadValue("belief model", model, "one of " + ", ".join(BELIEF_MODELS))
    if not 0 <= p.min(initial=0.0) <= p.max(initial=0.0) <= 1:  # nor nan
        raise BadValue("probability", "an entry that is not a probability", "within [0, 1]")
    before = unconditioned(p, model)
    return before if model == "exclusive" else _log_miss(before)


def unconditioned(probability: Floats, model: BeliefModel) -> Floats:
    """Probabilities not conditioned on the existence of an instance: z p for marginal, p for the others.

    If the model assumes an instance and every p is 0, equal small values are used.

    Args:
        probability: shape (..., containers).
    """
    if model == "independent":
        return probability
    if model == "marginal" and probability.size and (program := compiled_loops()) is not None:
        rows = np.ascontiguousarray(probability).reshape(-1, probability.shape[-1])
        made = program.unconditioned(rows, UNIFORM_PROBABILITY, MIN_EXISTENCE_PROBABILITY)
        return made.reshape(probability.shape)
    nowhere = ~(probability > 0).any(axis=-1, keepdims=True)
    p = np.where(nowhere, UNIFORM_PROBABILITY, probability)
    if model != "marginal" or not p.size:
        return p
    return p * np.maximum(existence_probability(p), MIN_EXISTENCE_PROBABILITY)


def existence_probability(p: Floats) -> Floats:
    """z, the positive root of 1 - product of (1 - z p) = z, or 0 where there is none: shape (..., 1).

    The left side minus the right side is concave in z, so Newton's method from 1 approaches the root from above.
    """
    z = np.ones((*p.shape[:-1], 1))
    for _ in range(60):
        with np.errstate(divide="ignore", invalid="ignore"):
            miss = np.exp(_log_miss(p * z).sum(axis=-1, keepdims=True))
            slope = miss * (p / (1 - p * z)).sum(axis=-1, keepdims=True) - 1
            step = (1 - miss - z) / slope
        step = np.where(np.isfinite(step), step, 0.0)
        z = np.maximum(z - step, 0.0)
        if np.abs(step).max(initial=0.0) < NEWTON_STEP:
            break
    return z


def still_missing(inside: Floats, outside: Floats, model: BeliefModel) -> Floats:
    """R(S) from the sums of `weights` over S and over all unsearched containers that are not in S.

    Args:
        inside, outside: of one shape, which is the answer's.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        if model == "independent":
            return np.exp(inside)
        if model == "exclusive":
            return outside / (inside + outside)
        return np.exp(inside) * np.abs(np.expm1(outside) / np.expm1(inside + outside))


def still_missing_by_subset(probability: Floats, candidates: Indices, model: BeliefModel) -> Floats:
    """R(S) for every subset S of the candidates; bit j of the subset's number stands for candidate j.

    Args:
        probability: shape (item types, containers), over all unsearched containers.
        candidates: indices into the containers, shape (item types, k).

    Returns:
        Shape (item types, 2**k); entry 0 of each is 1.
    """
    w = weights(probability, model)
    program = compiled_loops()
    if program is not None:
        return program.missing_by_subset(w, candidates, KINDS[model])
    return missing_by_subset(w, candidates, model)


def missing_by_subset(w: Floats, candidates: Indices, model: BeliefModel) -> Floats:
    """As still_missing_by_subset, from `weights`, shape (item types, containers)."""
    chosen = np.take_along_axis(w, candidates, axis=1)
    others = w.copy()
    np.put_along_axis(others, candidates, 0.0, axis=1)
    inside = np.zeros((len(w), 1))
    for j in range(candidates.shape[1]):
        inside = np.concatenate([inside, inside + chosen[:, j : j + 1]], axis=1)
    return still_missing(inside, inside[:, ::-1] + others.sum(axis=1, keepdims=True), model)


def still_missing_along(probability: Floats, order: Indices, model: BeliefModel) -> Floats:
    """R after each prefix of an order.

    Args:
        probability: shape (item types, containers).
        order: indices of containers, shape (item types, stops).

    Returns:
        Shape (item types, stops + 1), the first entry of each 1.
    """
    w = weights(probability, model)
    along = np.take_along_axis(w, order, axis=1)
    others = w.copy()
    np.put_along_axis(others, order, 0.0, axis=1)
    nothing = np.zeros((len(w), 1))
    inside = np.concatenate([nothing, np.cumsum(along, axis=1)], axis=1)
    outside = np.concatenate([np.cumsum(along[:, ::-1], axis=1)[:, ::-1], nothing], axis=1)
    return still_missing(inside, outside + others.sum(axis=1, keepdims=True), model)


@cache
def compiled_loops() -> ModuleType | None:
    """compiled_remaining, or None where numba cannot be imported."""
    try:
        from workbench.search import compiled_remaining
    except ImportError:
        return None
    return compiled_remaining


def _log_miss(p: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.log1p(-p)
