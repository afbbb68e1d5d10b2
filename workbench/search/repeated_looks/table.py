"""Find costs by Eq. 1 over states that count looks, and the sequence of looks that they price, where looks can miss.

Exact over the candidates of each item type. Two cases need no counting, and go to the program that looks once:

- a look that detects for certain (p = 1): a second one shows nothing new;
- looks that cost nothing (R_search = 0): by the triangle inequality, all looks into a container are best made at
  once, so that they are one look that misses with the chance (1 - p)^L.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Protocol, cast

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.beliefs.belief import Belief
from workbench.search import engine
from workbench.search.candidates import PAPER_LIMIT, Ranking, check_limit, choose, ranking_of
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.places import SearchSpace, search_space
from workbench.search.policy import SearchQuery
from workbench.search.repeated_looks import reference
from workbench.search.repeated_looks.missing import check_looks, still_missing_by_counts
from workbench.worlds.house import LocationId
from workbench.worlds.travel import TravelCosts

LOOKS = 2
"""Looks into a container that are counted by default."""

MAX_STATES = 1 << 20
"""Most states held in memory at once, over all item types."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookModel:
    """How Eq. 1 is extended.

    Attributes:
        belief_model: what probabilities mean after other containers turned out empty.
        limit: candidates per item type.
        looks: most looks into one container that are planned.
        ranking: how candidates are chosen; None takes the belief model's.

    Raises:
        BadValue, TooManyCandidates: `limit` or `looks` out of range.
    """

    belief_model: BeliefModel = "exists"
    limit: int = PAPER_LIMIT
    looks: int = LOOKS
    ranking: Ranking | None = None

    def __post_init__(self) -> None:
        check_limit(self.limit)
        check_looks(self.looks)


TWO_LOOKS = LookModel()
"""An instance exists; two looks into each of eight candidates."""


def robust_find_costs(
    belief: Belief,
    travel: TravelCosts,
    *,
    origins: Sequence[LocationId],
    targets: Sequence[LocationId],
    costs: ActionCosts,
    model: LookModel = TWO_LOOKS,
) -> FindCosts:
    """Eq. 1 over look counts for all (item type, origin, target), with the belief's chances that a look detects.

    Rows of item types that a look detects for certain are engine.expected_find_costs, to the last digit.

    Raises:
        LocationOutOfReach: an origin or target that is not among the travel costs.
    """
    here = search_space(belief, travel, origins=origins, targets=targets)
    miss = np.array([1.0 - belief.detects(t) for t in belief.item_types])
    metres = np.zeros((len(miss), len(origins), len(targets)))
    for rows, counted in ((np.flatnonzero(miss == 0), False), (np.flatnonzero(miss > 0), True)):
        if len(rows):
            some = replace(here, probability=here.probability[rows])
            metres[rows] = (
                _counted_table(some, miss[rows], costs, model)
                if counted
                else engine.cost_table(
                    some,
                    costs=costs,
                    belief_model=model.belief_model,
                    limit=model.limit,
                    ranking=model.ranking,
                )
            )
    return FindCosts(
        item_types=belief.item_types,
        origins=tuple(origins),
        targets=tuple(targets),
        metres=metres,
        kind="model",
        belief_model=model.belief_model,
    )


def best_looks(here: SearchSpace, item: int, detect: float, *, costs: ActionCosts, model: LookModel) -> Indices:
    """The optimal sequence of looks for one item type, from the first origin to the first target of `here`.

    Args:
        detect: the chance that one look detects the item where it is.

    Returns:
        Indices into here.containers; a container comes as often as it is looked into.
    """
    if detect == 1.0:
        return engine.best_order(
            here,
            item,
            costs=costs,
            belief_model=model.belief_model,
            limit=model.limit,
            ranking=model.ranking,
        )
    setup = _setup(
        replace(here, probability=here.probability[item : item + 1]), np.array([1.0 - detect]), costs, model
    )
    arrays = (setup.missing[0], setup.between_m[0], setup.from_m[0, 0], setup.found[0, :, 0], costs.search)
    if costs.search == 0:
        made = np.repeat(engine.program().best_order(*arrays), model.looks)
    else:
        made = np.array(program().best_sequence(*arrays, model.looks), dtype=np.intp)
    return setup.candidates[0, made]


def looks_of_query(query: SearchQuery, model: LookModel) -> tuple[SearchSpace, int, Indices]:
    """The search space of a query, the index of its item type, and the best looks."""
    here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
    item = query.belief.item_types.index(query.item_type)
    if not here.containers:
        return here, item, np.zeros(0, dtype=np.intp)
    detect = query.belief.detects(query.item_type)
    return here, item, best_looks(here, item, detect, costs=query.costs, model=model)


def _counted_table(here: SearchSpace, miss: Floats, costs: ActionCosts, model: LookModel) -> Floats:
    """The find costs of item types that looks can miss, shape (item types, origins, targets)."""
    metres = np.zeros((len(here.probability), len(here.from_m), here.to_m.shape[1]))
    if not here.containers or not metres.size:
        return metres
    base = 2 if costs.search == 0 else model.looks + 1
    at_once = max(1, MAX_STATES // base ** min(model.limit, len(here.containers)))
    for first in range(0, len(metres), at_once):
        part = slice(first, first + at_once)
        s = _setup(replace(here, probability=here.probability[part]), miss[part], costs, model)
        arrays = (s.missing, s.between_m, s.from_m, s.found, costs.search)
        if costs.search == 0:
            made = engine.program().cost_table(*arrays)
        else:
            made = program().cost_table(*arrays, model.looks)
        metres[part] = np.maximum(made, 0.0)
    return metres


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setup:
    """The arrays of reference.cost_table, with their candidates; where looks cost nothing, of the program that looks
    once."""

    candidates: Indices
    missing: Floats
    between_m: Floats
    from_m: Floats
    found: Floats


def _setup(here: SearchSpace, miss: Floats, costs: ActionCosts, model: LookModel) -> _Setup:
    chosen = choose(
        here.probability,
        here.from_m.mean(axis=0),
        here.to_m.mean(axis=1),
        limit=model.limit,
        ranking=model.ranking or ranking_of(model.belief_model),
    )
    counts = (0, model.looks) if costs.search == 0 else tuple(range(model.looks + 1))
    each = np.broadcast_to(miss[:, None], here.probability.shape)
    between_m, from_m, to_m = here.over(chosen)
    return _Setup(
        candidates=chosen,
        missing=still_missing_by_counts(here.probability, chosen, each, model.belief_model, counts),
        between_m=between_m,
        from_m=from_m,
        found=costs.manipulation + to_m,
    )


class LooksProgram(Protocol):
    """What reference.py and compiled.py of this folder both are."""

    def cost_table(
        self, missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
    ) -> Floats: ...

    def best_sequence(
        self, missing: Floats, between_m: Floats, from_m: Floats, found: Floats, search: float, looks: int
    ) -> list[int]: ...


@cache
def program() -> LooksProgram:
    """The compiled program, or the readable one where numba cannot be imported."""
    try:
        from workbench.search.repeated_looks import compiled
    except ImportError:
        return cast(LooksProgram, reference)
    return cast(LooksProgram, compiled)
