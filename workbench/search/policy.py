"""In which order does a find look into containers? The seam that search policies fill."""

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
    """Find an instance of item_type from origin and carry it to target, given a belief and travel costs."""

    item_type: ItemType
    origin: LocationId
    target: LocationId
    belief: Belief
    travel: TravelCosts
    costs: ActionCosts


class SearchPolicy(Protocol):
    """Chooses where to look next. Both kinds replan after every container, so only the first stop is walked."""

    @property
    def name(self) -> str: ...

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """The intended order, best first; empty when nothing is left to search."""
        ...


def first_stop(policy: SearchPolicy, query: SearchQuery) -> ContainerId | None:
    """Where a policy looks first; None when nothing is left to search."""
    first = getattr(policy, "first", None)
    if first is not None:
        return first(query)
    order = policy.order(query)
    return order[0].container if order else None
