"""The find costs that strategies plan with: optimistic, pessimistic, Eq. 1, and the oracle's true costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol, final

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.belief import Belief
from workbench.search.bounds import optimistic_find_costs, pessimistic_find_costs
from workbench.search.candidates import PAPER_LIMIT
from workbench.search.corrected import corrected_find_costs
from workbench.search.costs import ActionCosts
from workbench.search.engine import expected_find_costs
from workbench.search.find_costs import BeliefModel, FindCosts
from workbench.search.per_find import per_find_costs
from workbench.search.repeated_looks.table import TWO_LOOKS, LookModel, robust_find_costs
from workbench.worlds.house import House, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MAX_MEETING_PLACES = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class FindCostRequest:
    """A request for find costs of all item types of a belief, from every origin to every target."""

    belief: Belief
    travel: TravelCosts
    origins: Sequence[LocationId]
    targets: Sequence[LocationId]
    costs: ActionCosts

    def answered_by(self, formula: FindCostFormula) -> FindCosts:
        """The find costs of this request by a formula."""
        return formula(self.belief, self.travel, origins=self.origins, targets=self.targets, costs=self.costs)


class FindCostFormula(Protocol):
    """A function that computes find costs of all item types of a belief, from every origin to every target."""

    def __call__(
        self,
        belief: Belief,
        travel: TravelCosts,
        /,
        *,
        origins: Sequence[LocationId],
        targets: Sequence[LocationId],
        costs: ActionCosts,
    ) -> FindCosts: ...


class FindPricing(Protocol):
    """The find-cost model of a strategy."""

    def price(self, request: FindCostRequest) -> FindCosts: ...

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        """Unsearched containers that planning should consider as meeting places."""
        ...


@final
@dataclass(frozen=True, slots=True)
class Optimistic:
    """The paper's optimistic find cost: the object is in the container with the smallest detour."""

    def price(self, request: FindCostRequest) -> FindCosts:
        return request.answered_by(optimistic_find_costs)

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return ()


@final
@dataclass(frozen=True, slots=True)
class Pessimistic:
    """The paper's pessimistic find cost: the optimistic one plus a constant penalty."""

    def price(self, request: FindCostRequest) -> FindCosts:
        return request.answered_by(pessimistic_find_costs)

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return ()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """Eq. 1 under a belief model.

    Attributes:
        per_find: every find has its own candidates, as the search that carries it out; else one set an item type.
    """

    belief_model: BeliefModel = "independent"
    limit: int = PAPER_LIMIT
    per_find: bool = False

    def price(self, request: FindCostRequest) -> FindCosts:
        formula = per_find_costs if self.per_find else expected_find_costs
        return request.answered_by(partial(formula, belief_model=self.belief_model, limit=self.limit))

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return ()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class WithRepeatedLooks:
    """Eq. 1 over states that count looks, with the belief's chances that a look detects."""

    model: LookModel = TWO_LOOKS

    def price(self, request: FindCostRequest) -> FindCosts:
        return request.answered_by(partial(robust_find_costs, model=self.model))

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return ()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class WholeSearch:
    """Eq. 1, plus the expected cost of searching on if none of its candidates holds the object."""

    belief_model: BeliefModel = "marginal"
    limit: int = PAPER_LIMIT

    def price(self, request: FindCostRequest) -> FindCosts:
        return corrected_find_costs(
            request.belief,
            request.travel,
            origins=request.origins,
            targets=request.targets,
            costs=request.costs,
            belief_model=self.belief_model,
            limit=self.limit,
        )

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return ()


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TrueFindCosts:
    """The shortest route through a container that really holds the type; types that no container holds are left
    out.

    Only the oracle has it.
    """

    house: House

    def price(self, request: FindCostRequest) -> FindCosts:
        travel, costs = request.travel, request.costs
        rows = [travel.index(location) for location in request.origins]
        columns = [travel.index(location) for location in request.targets]
        open_to_search = frozenset(request.belief.containers)
        tables: dict[ItemType, Floats] = {}
        for item_type in request.belief.item_types:
            holders = [c for c in self.house.holders(item_type) if c in open_to_search]
            via = [travel.index(LocationId(container)) for container in holders]
            if via:
                lengths = travel.metres[np.ix_(rows, via)][:, :, None] + travel.metres[np.ix_(via, columns)][None]
                tables[item_type] = lengths.min(axis=1) + costs.search + costs.manipulation
        return FindCosts(
            item_types=tuple(tables),
            origins=tuple(request.origins),
            targets=tuple(request.targets),
            metres=np.array(list(tables.values())).reshape(len(tables), len(rows), len(columns)),
            kind="model",
        )

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        holders = {c for item_type in belief.item_types for c in self.house.holders(item_type)}
        return tuple(LocationId(c) for c in belief.containers if c in holders)[:MAX_MEETING_PLACES]
