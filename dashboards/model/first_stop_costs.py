"""Expected costs of the search for every other choice of the first container.

Each container of the intended order is moved to the front, the others keeping their order, and Eq. 1 of the paper is
evaluated along that order under the decision's own belief. A first stop that costs more than the chosen one explains
why it was not taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.beliefs.belief import Belief
from workbench.caches import PerObject
from workbench.errors import LiosError
from workbench.search.find_costs import BeliefModel
from workbench.search.orders import order_cost
from workbench.search.places import search_space
from workbench.search.remaining import BELIEF_MODELS
from workbench.worlds.house import ContainerId, ItemType, LocationId

if TYPE_CHECKING:
    from dashboards.model.timeline import DecisionFrame, Timeline
    from workbench.log_schema.events import BeliefUpdate, PlanComputed

MAX_STOPS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstLook:
    """One container as the first stop, with the expected cost of the whole search."""

    container: str
    probability: float
    cost: float
    chosen: bool


def first_looks(timeline: Timeline, frame: DecisionFrame) -> tuple[FirstLook, ...]:
    """Cheapest first; empty for a decision without a search, or whose log lacks the data.

    Computed once for each decision of a timeline that is in use.
    """
    return _FIRST_LOOKS.of(timeline).get(frame.number, lambda: _worked_out(timeline, frame))


_FIRST_LOOKS: PerObject[int, tuple[FirstLook, ...]] = PerObject(10_000)


def _worked_out(timeline: Timeline, frame: DecisionFrame) -> tuple[FirstLook, ...]:
    plan, update, place = frame.plan, frame.belief, timeline.run.place
    sought = _sought(plan)
    if plan is None or update is None or sought is None or sought[0] not in update.item_types:
        return ()
    item, target = sought
    order = [ContainerId(s.container) for s in plan.search_order[:MAX_STOPS] if s.container in update.containers]
    try:
        here = search_space(
            _belief(update, item), place.travel, origins=(LocationId(plan.robot_at),), targets=(LocationId(target),)
        )
        index = {container: i for i, container in enumerate(here.containers)}
        stops = [index[c] for c in order if c in index]
        made = [
            (
                order_cost(
                    [k, *(s for s in stops if s != k)], here, model=_model(frame), costs=timeline.run.costs
                ).cost,
                k,
            )
            for k in stops
        ]
    except LiosError:
        return ()
    looks = [
        FirstLook(
            container=here.containers[k], probability=float(here.probability[0, k]), cost=cost, chosen=k == stops[0]
        )
        for cost, k in made
        if np.isfinite(cost)
    ]
    return tuple(sorted(looks, key=lambda look: (look.cost, not look.chosen, look.container)))


def _sought(plan: PlanComputed | None) -> tuple[str, str] | None:
    """What the plan finds first, and where it is brought."""
    steps = plan.steps if plan is not None else ()
    return next(((s.item_types[0], s.target) for s in steps if s.action == "find" and s.item_types), None)


def _belief(update: BeliefUpdate, item: str) -> Belief:
    row = np.array(update.probability[update.item_types.index(item)], dtype=np.float64)
    return Belief(
        item_types=(ItemType(item),),
        containers=tuple(ContainerId(c) for c in update.containers),
        probability=row[None],
        estimator=update.estimator,
    )


def _model(frame: DecisionFrame) -> BeliefModel:
    models: dict[str, BeliefModel] = {model: model for model in BELIEF_MODELS}
    return models.get(frame.find_costs.belief_model if frame.find_costs is not None else "", "independent")
