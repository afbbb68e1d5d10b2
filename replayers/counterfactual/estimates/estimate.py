"""Mean cost and predictive interval of a counterfactual run, over worlds sampled from the belief.

Everything here is sampled and says so: means with a Monte-Carlo interval, a predictive interval of the cost itself.
Bounds are in bounds.py, and calibration.py measures how often such estimates hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, inf, sqrt

import numpy as np

from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds, Worlds, marked
from replayers.counterfactual.results import Estimate
from replayers.counterfactual.run_nodes import Node
from replayers.counterfactual.run_tree import RunTree
from workbench.arrays import Bools, Floats
from workbench.execution.events import RunStatus
from workbench.tolerances import NEAR_COST, ROUNDING

MIN_WORLDS = 50
Z95 = 1.959964
MASS = 0.9
"""The nominal share of sampled worlds in the predictive interval."""


def costs_in(worlds: SampledWorlds, tree: RunTree, *, max_segments: int | None = None) -> tuple[Floats, Bools]:
    """A strategy's cost in each world, shape (worlds,), and whether it did the task there, bool, shape (worlds,).

    Args:
        max_segments: after so many new segments of the loop the remaining worlds are left out, but never below
            MIN_WORLDS. The first worlds are the same for every strategy, so comparisons stay paired.
    """
    began, count = tree.segments, len(worlds)
    costs, done, known = np.zeros(count), np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    for some, cost, is_done in _known_ends(worlds, tree):
        there = marked(some, count)
        costs[there], done[there], known[there] = cost, is_done, True
    limit, followed = inf if max_segments is None else max_segments, 0
    for world in np.flatnonzero(~known).tolist():
        if world >= MIN_WORLDS and tree.segments - began >= limit:
            break
        leaf, followed = tree.follow(worlds.chooser(world)), world + 1
        costs[world], done[world] = leaf.cost, leaf.status is RunStatus.DONE
    kept = count if tree.segments - began < limit else max(MIN_WORLDS, followed)
    return costs[:kept], done[:kept]


def _known_ends(worlds: SampledWorlds, tree: RunTree) -> Iterator[tuple[Worlds, float, bool]]:
    """The worlds that end where the tree was followed already, with the cost, and whether the task was done.

    Worlds go down the tree together as long as they give the same answers.
    """
    waiting: list[tuple[Node, float, Worlds]] = [(tree.root, 0.0, (1 << len(worlds)) - 1)]
    while waiting:
        node, cost, group = waiting.pop()
        segment = node.segment
        if segment is None or node.ambiguous:
            continue
        cost += segment.cost
        look = segment.unobserved
        if look is None:
            yield (group, cost, True) if segment.done else (group, tree.evidence.task.failure_cost, False)
            continue
        for answer, some in worlds.answers(look.container, look.live):
            if some & group:
                child = node.children.get(answer if look.allows(answer) else look.options[0])
                if child is not None:
                    waiting.append((child, cost, some & group))


def estimate_of(costs: Floats, done: Bools) -> Estimate:
    """The estimate from the costs in sampled worlds."""
    mean, half = float(costs.mean()), Z95 * float(costs.std(ddof=1)) / sqrt(len(costs)) if len(costs) > 1 else 0.0
    interval = predictive_interval(costs)
    return Estimate(
        mean=mean,
        ci95=(mean - half, mean + half),
        interval90=interval,
        interval90_mass=mass_within(costs, interval),
        success=float(done.mean()),
        worlds=len(costs),
    )


def predictive_interval(costs: Floats, mass: float = MASS) -> tuple[float, float]:
    """The shortest closed interval that contains at least `mass` of the sampled costs; the lowest of equally short
    ones.

    A highest-density region restricted to a single interval (Hyndman, "Computing and Graphing Highest Density
    Regions", The American Statistician 50, 1996).
    """
    ordered = np.sort(costs)
    held = min(max(1, ceil(mass * len(ordered) - ROUNDING)), len(ordered))
    widths = ordered[held - 1 :] - ordered[: len(ordered) - held + 1]
    first = int(np.argmax(widths <= widths.min() + NEAR_COST))
    return float(ordered[first]), float(ordered[first + held - 1])


def mass_within(costs: Floats, interval: tuple[float, float]) -> float:
    """The share of sampled costs in a closed interval."""
    low, high = interval
    return float(np.mean((costs >= low - NEAR_COST) & (costs <= high + NEAR_COST)))
