"""What does a find cost in fact? Eq. 1 with what it leaves out, and scaled to what searches have cost.

Eq. 1 over a few candidates is too low in two ways. Where the object is in none of them, it counts nothing more;
here the search goes on: the other containers follow, always the one of greatest probability against the way from
the last, and their cost is what remains once all candidates have been searched. And beliefs err, mostly on the
confident side; here a scale, one number per estimator, brings the mean of what was predicted to the mean of what
was realised on validation houses. Neither changes the order of a search: a scale cannot, and the other containers
come last in any case.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.search.candidates import PAPER_LIMIT, Ranking
from workbench.search.costs import ActionCosts
from workbench.search.engine import cost_table
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.places import Places, places
from workbench.search.remaining import compiled_loops, still_missing_along, unconditioned
from workbench.search.ties import RELATIVE
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

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
    ranking: Ranking | None = None,
    scale: float | None = None,
) -> FindCosts:
    """Find costs that are right on average.

    Args:
        scale: realised over predicted; None takes the estimator's, by the name in the belief.
        The others as expected_find_costs.

    Raises:
        BadValue: a scale that is not positive and finite.
        The others as expected_find_costs.
    """
    factor = scale_of(belief.estimator) if scale is None else scale
    if not isfinite(factor) or factor <= 0:
        raise BadValue("scale of find costs", factor, "positive and finite")
    here = places(belief, travel, origins=origins, targets=targets)
    metres = cost_table(
        here,
        costs=costs,
        belief_model=belief_model,
        limit=limit,
        ranking=ranking,
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
    here: Places, probability: Array, candidates: Indices, *, costs: ActionCosts, model: BeliefModel
) -> Array:
    """What follows once every candidate has been searched, weighted by the chance that it comes to that.

    The order of the other containers is one per item type: it begins with the one of greatest probability against
    the mean way from the candidates, and goes on from there.

    Args:
        probability: of the item types that are asked about, shape (item types, containers).
        candidates: shape (item types, k).

    Returns:
        By last candidate and target, shape (item types, k, targets).
    """
    items, k = candidates.shape
    if k == len(here.containers):
        return np.zeros((items, k, here.to_m.shape[1]))
    order = _others(unconditioned(probability, model), candidates, here.between_m)
    missing = still_missing_along(probability, np.concatenate([candidates, order], axis=1), model)[:, k:]
    legs = here.between_m[order[:, :-1], order[:, 1:]]
    ends = missing[:, :-1] - missing[:, 1:]
    walks = (missing[:, 1:-1] * legs).sum(axis=1) + missing[:, :-1].sum(axis=1) * costs.search
    finds = np.einsum("ij,ijt->it", ends, costs.manipulation + here.to_m[order])
    there = missing[:, :1] * here.between_m[candidates, order[:, :1]]
    return there[:, :, None] + (walks[:, None] + finds)[:, None, :]


def _others(p: Array, searched: Indices, between_m: Array) -> Indices:
    """The containers that are no candidates, in the order in which they follow: shape (item types, others)."""
    from_m = between_m[searched].mean(axis=1)
    program = compiled_loops()
    return (
        others(p, searched, from_m, between_m) if program is None else program.others(p, searched, from_m, between_m)
    )


def others(p: Array, searched: Indices, from_m: Array, between_m: Array) -> Indices:
    """The same from the mean way from what was searched to each container, shape (item types, containers).

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
