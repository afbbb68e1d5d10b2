"""Trials of the paper's object-search experiment: find one item type and bring it to the start.

A trial is a house, an item type that the house holds, and a policy. The robot is at the start, knows no container's
contents, searches where the policy says, updates its belief after every look, and picks the first instance and
returns. Trials are computed directly on the house's contents and travel costs, which is many times faster than the
closed loop (run_task); tests check for every policy that both give exactly the same cost.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np

from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.warm_up import warm_up
from workbench.plugins import NameOrigin
from workbench.search.corrected import corrected_find_costs
from workbench.search.costs import ActionCosts
from workbench.search.policies.oracle import oracle_policy
from workbench.search.policies.registry import policy
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, Contents, House, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

ORACLE = "oracle"
PAPER_POLICY = "lios"
ASKS_NO_BELIEF = ("greedy", ORACLE)
"""Policies that use no probabilities; no belief is computed for them."""

Stopwatch = Callable[[], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTrial:
    """One search trial.

    Attributes:
        house: the house's name.
        cost: total cost of travel, looks and the pick, including the way back, in cost units.
        order: searched containers; the last one holds the item. Where looks can miss, one may come again.
        said: predicted probability before each look that it finds an instance; empty for policies without beliefs.
        predicted: the policy's own expected cost before the first step; None for a policy without one.
        corrected: the corrected find cost of the same query (search/corrected.py), for policies of ours.
        decide_s: time of all decisions without beliefs, in seconds.
        believe_s: time of computing beliefs in seconds; 0 for cached beliefs.
        found: whether the search ended with the item.
    """

    house: str
    item_type: ItemType
    policy: str
    cost: float
    order: tuple[ContainerId, ...]
    said: tuple[float, ...] = ()
    predicted: float | None = None
    corrected: float | None = None
    decide_s: float = 0.0
    believe_s: float = 0.0
    found: bool = True

    @property
    def kind(self) -> str:
        return kind_of(self.item_type)


def kind_of(item_type: ItemType) -> str:
    """Whether an item type is one of AI2-THOR's or an Objaverse asset's."""
    return "objaverse" if item_type.startswith("Obja") else "ai2-thor"


def queries(house: House, travel: TravelCosts) -> tuple[ItemType, ...]:
    """All item types with a reachable instance in a container, sorted."""
    reachable = [c.id for c in house.plan.containers if travel.reaches(LocationId(c.id))]
    return tuple(sorted({item.type for c in reachable for item in house.contents[c]}))


@final
@dataclass(slots=True)
class Beliefs:
    """An estimator's beliefs in one house, cached by the set of searched containers.

    The same knowledge gives the same belief, so queries that open the same containers share them.
    """

    estimator: Estimator
    item_types: tuple[ItemType, ...]
    seconds: float = 0.0
    stopwatch: Stopwatch = time.perf_counter
    _known: dict[tuple[tuple[ContainerId, ...], ItemType], Belief] = field(default_factory=dict)

    def about(self, item_type: ItemType, knowledge: Knowledge) -> Belief:
        """The belief about one item type."""
        seen = tuple(sorted(knowledge.first_seen))
        if (seen, item_type) not in self._known:
            began = self.stopwatch()
            wanted = (item_type,) if seen or item_type not in self.item_types else self.item_types
            belief = self.estimator.believe(knowledge, wanted)
            for i, name in enumerate(wanted):
                row = replace(belief, item_types=(name,), probability=belief.probability[i : i + 1])
                self._known[seen, name] = row
            self.seconds += self.stopwatch() - began
        return self._known[seen, item_type]


def search_trial(
    house: House,
    travel: TravelCosts,
    item_type: ItemType,
    searcher: SearchPolicy,
    beliefs: Beliefs | None,
    *,
    costs: ActionCosts,
    known: Contents | None = None,
    stopwatch: Stopwatch = time.perf_counter,
) -> SearchTrial:
    """Run one search trial.

    Args:
        beliefs: None for a policy without beliefs.
        known: contents that are known from the start, without an instance.

    Raises:
        ValueError: the house holds no reachable instance.
    """
    knowledge = knowledge_at_start(house.plan, travel, known or {})
    cost, decide_s = 0.0, 0.0
    before_s = beliefs.seconds if beliefs else 0.0
    first: SearchQuery | None = None
    said: list[float] = []
    while knowledge.unsearched:
        query = SearchQuery(
            item_type=item_type,
            origin=knowledge.robot_at,
            target=START,
            belief=empty_belief(item_type, knowledge) if beliefs is None else beliefs.about(item_type, knowledge),
            travel=travel,
            costs=costs,
        )
        first = first or query
        began = stopwatch()
        container = first_stop(searcher, query)
        decide_s += stopwatch() - began
        if container is None:
            break
        if beliefs is not None:
            said.append(float(query.belief.of(item_type)[query.belief.containers.index(container)]))
        there = LocationId(container)
        cost += _metres(travel, knowledge.robot_at, there) + costs.search
        held = house.contents[container]
        knowledge = knowledge.moved(there).seen(container, held)
        if any(item.type == item_type for item in held):
            return SearchTrial(
                house=house.plan.name,
                item_type=item_type,
                policy=searcher.name,
                cost=cost + costs.manipulation + _metres(travel, there, START),
                order=knowledge.visited,
                said=tuple(said),
                predicted=_predicted(searcher, first),
                corrected=None if beliefs is None or searcher.name == PAPER_POLICY else _corrected(first),
                decide_s=decide_s,
                believe_s=(beliefs.seconds if beliefs else 0.0) - before_s,
            )
    raise ValueError(f"{house.plan.name} holds no {item_type} that can be reached")


def house_trials(
    house: House,
    travel: TravelCosts,
    *,
    policies: Sequence[str],
    estimators: Callable[[str], Estimator],
    costs: ActionCosts,
    item_types: Sequence[ItemType] | None = None,
) -> list[SearchTrial]:
    """Every policy on every query of one house.

    Args:
        policies: names; "oracle" is the policy that knows the house.
        estimators: returns the estimator for a policy name; called once per policy.
        item_types: the queries; None for all.
    """
    wanted = queries(house, travel) if item_types is None else tuple(item_types)
    beliefs: dict[str, Beliefs] = {}
    trials: list[SearchTrial] = []
    for name in policies:
        searcher = oracle_policy(house) if name == ORACLE else policy(name, origin=NameOrigin.USER)
        asked = None
        if name not in ASKS_NO_BELIEF:
            estimator = estimators(name)
            warm_up(knowledge_at_start(house.plan, travel, {}), estimator, wanted[:1])
            asked = beliefs.setdefault(estimator.name, Beliefs(estimator, wanted))
        trials += [search_trial(house, travel, item, searcher, asked, costs=costs) for item in wanted]
    return trials


def _metres(travel: TravelCosts, a: LocationId, b: LocationId) -> float:
    return float(travel.metres[travel.index(a), travel.index(b)])


def empty_belief(item_type: ItemType, knowledge: Knowledge) -> Belief:
    """The belief that a policy without beliefs is given: no chance anywhere."""
    containers = knowledge.unsearched
    return Belief(
        item_types=(item_type,), containers=containers, probability=np.zeros((1, len(containers))), estimator="none"
    )


def _predicted(searcher: SearchPolicy, query: SearchQuery) -> float | None:
    search = getattr(searcher, "search", None)
    return None if search is None else float(search(query).cost)


def _corrected(query: SearchQuery) -> float:
    table = corrected_find_costs(
        query.belief, query.travel, origins=(query.origin,), targets=(query.target,), costs=query.costs
    )
    return float(table.metres[0, 0, 0])
