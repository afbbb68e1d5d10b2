"""Samples of the items that the recorded looks overlooked, given the log and the number of misses.

A type that is in a container with probability P and that n looks would each have missed with chance 1 - p is there,
unseen, with odds P / (1 - P) times (1 - p)^n (Bayes). Worlds are drawn exactly given the total number of overlooked
items: forward the weights of every number for each type, backward a number for each type and the containers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import Bools, Floats
from workbench.tolerances import ROUNDING

MAX_PROBABILITY = 1.0 - ROUNDING
"""The largest probability whose odds are taken."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MissWeights:
    """Weights of what may have been overlooked.

    Attributes:
        odds: of each type in each container that was looked into, shape (types, containers); 0 where it cannot be.
        required: per type, whether an instance must be somewhere, though the log shows none; shape (types,).
        elsewhere: per type, the probability that an unopened container holds it; shape (types,).
        least, most: how many items were overlooked in all.
    """

    odds: Floats
    required: Bools
    elsewhere: Floats
    least: int
    most: int


def odds_of(probability: Floats) -> Floats:
    """p / (1 - p), elementwise; certainty counts as nearly certain."""
    p = np.minimum(probability, MAX_PROBABILITY)
    return np.asarray(p / (1.0 - p))


def sample_misses(weights: MissWeights, count: int, rng: np.random.Generator) -> Bools:
    """Samples what was overlooked.

    Returns:
        Shape (count, types, containers): whether an instance is there that no look showed. All False where no world
        fits the weights.
    """
    types, containers = weights.odds.shape
    drawn = np.zeros((count, types, containers), dtype=bool)
    sizes = weights.most + 1
    by_type = np.array([_weights_of_numbers(weights, i) for i in range(types)]).reshape(types, sizes)
    ahead = _all_later(by_type, sizes)
    total = ahead[0].copy()
    total[: weights.least] = 0.0
    if not total.sum() > 0:
        return drawn
    for world, left in enumerate(rng.choice(sizes, size=count, p=total / total.sum())):
        remaining = int(left)
        for i in range(types):
            chance = by_type[i, : remaining + 1] * ahead[i + 1][remaining::-1]
            number = int(rng.choice(remaining + 1, p=chance / chance.sum()))
            drawn[world, i] = _choose(weights.odds[i], number, rng)
            remaining -= number
    return drawn


def _weights_of_numbers(weights: MissWeights, i: int) -> Floats:
    """The weight of each number of containers in which one type was overlooked; shape (most + 1,)."""
    counted = _elementary(weights.odds[i], weights.most + 1)
    if weights.required[i]:
        counted[0] *= weights.elsewhere[i]
    return counted


def _elementary(odds: Floats, sizes: int) -> Floats:
    """Elementary symmetric polynomials of the odds: the weight of each number of containers; shape (sizes,)."""
    found = np.zeros(sizes)
    found[0] = 1.0
    for value in odds:
        found[1:] += value * found[:-1]
    return found


def _all_later(by_type: Floats, sizes: int) -> list[Floats]:
    """For each type, the weights of the total number over it and all later types; after the last, of none."""
    later = [np.eye(1, sizes)[0]]
    for row in by_type[::-1]:
        later.append(np.convolve(row, later[-1])[:sizes])
    return later[::-1]


def _choose(odds: Floats, number: int, rng: np.random.Generator) -> Bools:
    """So many containers, each set with weight proportional to the product of its odds (conditional Bernoulli)."""
    chosen = np.zeros(len(odds), dtype=bool)
    for j in range(len(odds)):
        if number == 0:
            break
        with_it = odds[j] * _elementary(odds[j + 1 :], number)[number - 1]
        without = _elementary(odds[j + 1 :], number + 1)[number]
        if rng.random() * (with_it + without) < with_it:
            chosen[j] = True
            number -= 1
    return chosen
