"""What would it have cost on average, and who would have won, over worlds drawn from the belief?

Everything here is sampled and says so: means with a Monte-Carlo interval, a predictive interval of the cost itself,
the chance that one strategy beats another in the same world. Bounds stand elsewhere (bounds.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
import numpy.typing as npt

from replayers.drawn_worlds import DrawnWorlds
from replayers.unfolding import Unfolding
from workbench.execution.events import RunStatus

Floats = npt.NDArray[np.float64]

FEWEST_WORLDS = 50
Z95 = 1.959964
MASS = 0.9
"""The share of drawn worlds that the predictive interval aims to hold."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A mean over drawn worlds.

    Attributes:
        mean: of the charged cost.
        ci95: the Monte-Carlo interval of that mean: more worlds make it narrower.
        interval90: where the cost itself lies in nine of ten drawn worlds.
        success: share of worlds in which the task was done.
        worlds: how many were drawn.
    """

    mean: float
    ci95: tuple[float, float]
    interval90: tuple[float, float]
    success: float
    worlds: int


def costs_in(
    worlds: DrawnWorlds, tree: Unfolding, *, most_stretches: int | None = None
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """What a strategy costs in each world, shape (worlds,), and whether it did the task there.

    Args:
        most_stretches: after so many new stretches of the loop the remaining worlds are left out, but never below
            FEWEST_WORLDS. The first worlds are the same for every strategy, so comparisons stay paired.
    """
    costs, done = np.zeros(len(worlds)), np.zeros(len(worlds), dtype=bool)
    began = tree.stretches
    for world in range(len(worlds)):
        spent = tree.stretches - began
        if most_stretches is not None and world >= FEWEST_WORLDS and spent >= most_stretches:
            return costs[:world], done[:world]

        leaf = tree.follow(worlds.chooser(world))
        costs[world], done[world] = leaf.cost, leaf.status is RunStatus.DONE
    return costs, done


def estimate_of(costs: Floats, done: npt.NDArray[np.bool_]) -> Estimate:
    """The estimate from the costs in drawn worlds."""
    mean, half = float(costs.mean()), Z95 * float(costs.std(ddof=1)) / sqrt(len(costs)) if len(costs) > 1 else 0.0
    return Estimate(
        mean=mean,
        ci95=(mean - half, mean + half),
        interval90=predictive_interval(costs),
        success=float(done.mean()),
        worlds=len(costs),
    )


def predictive_interval(costs: Floats, mass: float = MASS) -> tuple[float, float]:
    """The central interval of drawn costs, both ends included: at least `mass` of the draws lie in it."""
    tail = (1 - mass) / 2
    low = float(np.quantile(costs, tail, method="inverted_cdf"))
    return low, float(np.quantile(costs, 1 - tail, method="inverted_cdf"))


def share_within(costs: Floats, truth: float, mass: float = MASS, *, near: float = 1e-4) -> float:
    """How much of a true cost lies in the central interval, when a cost at its end counts by the share of its
    probability that lies inside.

    Costs come in lumps: an interval with both ends holds more than it aims at. Counted so, the mean over many
    replays is `mass` exactly when the draws are calibrated (the non-randomized probability integral transform of
    Czado, Gneiting and Held, Biometrics 65, 2009).
    """
    below, up_to = float(np.mean(costs < truth - near)), float(np.mean(costs <= truth + near))
    low, high = (1 - mass) / 2, 1 - (1 - mass) / 2
    if up_to - below <= 0:
        return float(low <= below <= high)
    return max(0.0, min(up_to, high) - max(below, low)) / (up_to - below)


def beats(a: Floats, b: Floats, *, near: float = 1e-6) -> tuple[float, float]:
    """In which share of the same drawn worlds a is cheaper than b, and in which they cost the same."""
    return float(np.mean(a < b - near)), float(np.mean(np.abs(a - b) <= near))
