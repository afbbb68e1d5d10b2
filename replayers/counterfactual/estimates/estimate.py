"""Mean cost and predictive interval of a counterfactual run, over worlds sampled from the belief.

Everything here is sampled and says so: means with a Monte-Carlo interval, a predictive interval of the cost itself.
Bounds are in bounds.py, and calibration.py measures how often such estimates hold.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, sqrt

import numpy as np

from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds
from replayers.counterfactual.relevance import Answer
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
    began, known = tree.segments, _known_ends(worlds, tree)
    if len(known) == len(worlds) and max_segments != 0:
        ends = [known[world] for world in range(len(worlds))]
        return np.array([cost for cost, _ in ends]), np.array([done for _, done in ends], dtype=bool)
    costs, done = np.zeros(len(worlds)), np.zeros(len(worlds), dtype=bool)
    for world in range(len(worlds)):
        spent = tree.segments - began
        if max_segments is not None and world >= MIN_WORLDS and spent >= max_segments:
            return costs[:world], done[:world]
        if world in known:
            costs[world], done[world] = known[world]
        else:
            leaf = tree.follow(worlds.chooser(world))
            costs[world], done[world] = leaf.cost, leaf.status is RunStatus.DONE
    return costs, done


def _known_ends(worlds: SampledWorlds, tree: RunTree) -> dict[int, tuple[float, bool]]:
    """The cost, and whether the task was done, in each world that ends where the tree was followed already.

    Worlds go down the tree together as long as they give the same answers.
    """
    ends: dict[int, tuple[float, bool]] = {}
    waiting: list[tuple[Node, float, Iterable[int]]] = [(tree.root, 0.0, range(len(worlds)))]
    while waiting:
        node, cost, group = waiting.pop()
        segment = node.segment
        if segment is None or node.ambiguous:
            continue
        cost += segment.cost
        look = segment.unobserved
        if look is None:
            end = (cost, True) if segment.done else (tree.evidence.task.failure_cost, False)
            ends |= dict.fromkeys(group, end)
            continue
        answers, alike = worlds.answers(look.container, look.live), dict[Answer, list[int]]()
        for world in group:
            alike.setdefault(answers[world], []).append(world)
        for answer, some in alike.items():
            child = node.children.get(answer if look.allows(answer) else look.options[0])
            if child is not None:
                waiting.append((child, cost, some))
    return ends


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
