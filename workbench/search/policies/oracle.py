"""The oracle search policy, which goes straight to the best instance and is a lower bound for all policies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from workbench.search.find_costs import SearchStop
from workbench.search.places import search_space
from workbench.search.policy import SearchQuery
from workbench.search.ties import first_of_least
from workbench.worlds.house import House


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class OraclePolicy:
    """The container that really holds the object, by the shortest route to the target; it knows the true house."""

    house: House
    name: str = "oracle"

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """The container with the type that has the least d(origin, a) + d(a, target); empty if no unsearched
        container holds the type."""
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        holders = frozenset(self.house.holders(query.item_type))
        routes = [(here.from_m[0, i] + here.to_m[i, 0], i) for i, c in enumerate(here.containers) if c in holders]
        if not routes:
            return ()
        nearest = first_of_least(routes, lambda route: float(route[0]))[1]
        return (
            SearchStop(
                container=here.containers[nearest],
                probability=1.0,
                reached=1.0,
                leg_m=float(here.from_m[0, nearest]),
            ),
        )


def oracle_policy(house: House) -> OraclePolicy:
    """The oracle of a house."""
    return OraclePolicy(house=house)
