"""The search policy protocol: the order in which a find looks into containers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from workbench.beliefs.belief import Belief
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import SearchStop
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchQuery:
    """A request to find an instance of item_type from origin and carry it to target, given a belief and travel
    costs."""

    item_type: ItemType
    origin: LocationId
    target: LocationId
    belief: Belief
    travel: TravelCosts
    costs: ActionCosts


class SearchPolicy(Protocol):
    """Chooses where to look next. Policies are asked again after every container, so only the first stop is
    visited."""

    @property
    def name(self) -> str: ...

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """The intended search order; empty if nothing is left to search."""
        ...


def first_stop(policy: SearchPolicy, query: SearchQuery) -> ContainerId | None:
    """The container that a policy searches first; None if nothing is left to search."""
    first = getattr(policy, "first", None)
    if first is not None:
        return first(query)
    order = policy.order(query)
    return order[0].container if order else None
