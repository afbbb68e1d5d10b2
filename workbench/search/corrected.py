"""Find costs by Eq. 1, corrected for containers beyond its candidates and calibrated to realised search costs.

Eq. 1 over a few candidates is too low for two reasons. If the object is in none of them, it counts no further cost;
here the search goes on through the other containers, each time to the one with the largest ratio of probability to
distance. And beliefs are overconfident; here a scale, one number per estimator, brings the mean predicted cost to
the mean realised cost. Neither changes the order of a search: a scale cannot, and the other containers come last in
any case.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from types import MappingProxyType

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.search.candidates import PAPER_LIMIT
from workbench.search.costs import ActionCosts
from workbench.search.engine import cost_table
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.places import SearchSpace, search_space
from workbench.search.remaining import compiled_loops, still_missing_along, unconditioned
from workbench.tolerances import RELATIVE
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts

SCALES: Mapping[str, float] = MappingProxyType({"best": 0.97})
"""Realised over predicted cost by estimator, of `marginal-lios` over the training houses, each searched with weights
that were trained without it (five folds); an estimator without an entry has scale 1."""


def corrected_find_costs(
    belief: Belief,
    travel: TravelCosts,
    *,
    origins: Sequence[LocationId],
    targets: Sequence[LocationId],
    costs: ActionCosts,
    belief_model: BeliefModel = "marginal",
    limit: int = PAPER_LIMIT,
    scale: float | None = None,
) -> FindCosts:
    """Find costs that are calibrated on average.

    Args:
        scale: realised over predicted cost; None takes the scale of the belief's estimator.

    The other arguments are those of expected_find_costs.

    Raises:
        BadValue: a scale that is not positive and finite.
        The others as expected_find_costs.
    """
    factor = scale_of(belief.estimator) if scale is None else scale
    if not isfinite(factor) or factor <= 0:
        raise BadValue("scale of find costs", factor, "positive and finite")
    here = search_space(belief, travel, origins=origins, targets=targets)
    metres = cost_table(
        here,
        costs=costs,
        belief_model=belief_model,
        limit=limit,
        tail=lambda p, candidates: tail_costs(here, p, candidates, costs=costs, model=belief_model),
    )
    return FindCosts(
        item_types=belief.item_types,
        origins=tuple(origins),
        targets=tuple(targets),
        metres=factor * metres,
        kind="model",
        belief_model=belief_model,
    )


def scale_of(estimator: str) -> float:
    """The scale of an estimator by its name, with or without the hash of its weights."""
    return SCALES.get(estimator.partition("@")[0], 1.0)


def tail_costs(
    here: SearchSpace, probability: Floats, candidates: Indices, *, costs: ActionCosts, model: BeliefModel
) -> Floats:
    """The cost of searching on after every candidate, weighted by the probability that the object is in none of
    them.

    Each item type has one order of the other containers: it begins with the largest ratio of probability to mean
    distance from the candidates, and continues from there.

    Args:
        probability: probability of each container, shape (item types, containers).
        candidates: shape (item types, k).

    Returns:
        Costs by last candidate and target, shape (item types, k, targets).
    """
    items, k = candidates.shape
    if k == len(here.containers):
        return np.zeros((items, k, here.to_m.shape[1]))
    nearest = here.between_m[candidates].mean(axis=1)
    order = order_beyond(unconditioned(probability, model), candidates, nearest, here.between_m)
    missing = still_missing_along(probability, np.concatenate([candidates, order], axis=1), model)[:, k:]
    legs = here.between_m[order[:, :-1], order[:, 1:]]
    ends = missing[:, :-1] - missing[:, 1:]
    walks = (missing[:, 1:-1] * legs).sum(axis=1) + missing[:, :-1].sum(axis=1) * costs.search
    finds = np.einsum("ij,ijt->it", ends, costs.manipulation + here.to_m[order])
    there = missing[:, :1] * here.between_m[candidates, order[:, :1]]
    return there[:, :, None] + (walks[:, None] + finds)[:, None, :]


def order_beyond(p: Floats, searched: Indices, from_m: Floats, between_m: Floats) -> Indices:
    """The containers beyond those searched, each time the one of the largest ratio of probability to distance.

    Args:
        p: shape (item types, containers).
        searched: shape (item types, k).
        from_m: the distance to each container from what was searched, shape (item types, containers).
        between_m: shape (containers, containers).

    Returns:
        Shape (item types, containers - k).
    """
    program = compiled_loops()
    order = non_candidate_order if program is None else program.non_candidate_order
    return order(p, searched, from_m, between_m)


def non_candidate_order(p: Floats, searched: Indices, from_m: Floats, between_m: Floats) -> Indices:
    """The same in numpy.

    Worths are equal that differ by less than a share of the greatest probability (ties.py).
    """
    rows = np.arange(len(p))
    left = np.ones(p.shape, dtype=bool)
    np.put_along_axis(left, searched, False, axis=1)
    slack = RELATIVE * p.max(axis=1, keepdims=True, initial=0.0)
    order: list[Indices] = []
    for _ in range(p.shape[1] - searched.shape[1]):
        worth = np.where(left, p / (1.0 + from_m), -1.0)
        chosen = np.argmax(worth >= worth.max(axis=1, keepdims=True) - slack, axis=1)
        order.append(chosen)
        left[rows, chosen] = False
        from_m = between_m[chosen]
    return np.stack(order, axis=1)
