"""What can a run still cost at most, in the unluckiest of the worlds that agree with the log?

Two bounds from above. One holds for every strategy: the step limit ends a run, and no step costs more than the
longest way. The other holds for strategies that go *straight*: between two looks they only fetch what a part of
the goal asks for and bring it there, each part once. Every run that is explored is checked against that; a strategy
that breaks it is left with the first bound.
"""

from __future__ import annotations

from typing import final

import numpy as np

from replayers.evidence import Evidence
from replayers.relevance import most_instances
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.knowledge import Knowledge


@final
class MostToWalk:
    """The bounds for one log and one task."""

    def __init__(self, evidence: Evidence, *, max_steps: int) -> None:
        travel = evidence.place.travel
        self._metres = np.asarray(travel.metres)
        self._index = {name: i for i, name in enumerate(travel.locations)}
        self._costs = evidence.costs
        self._failure = evidence.task.failure_cost
        self._goal = evidence.task.goal
        self._max_steps = max_steps
        self._searchable = tuple(LocationId(c) for c in (*evidence.contents, *evidence.open, *evidence.shut))
        self.fits_straight = _plain(self._goal)
        self.most_picks = most_instances(self._goal)

    def by_step_limit(self, own_cost: float) -> float:
        """For every strategy."""
        dearest = max(float(self._metres.max(initial=0.0)), self._costs.manipulation, self._costs.search)
        return max(self._failure, own_cost + self._max_steps * dearest)

    def going_straight(self, own_cost: float, knowledge: Knowledge, container: ContainerId) -> float:
        """For strategies that go straight, after a look into `container`."""
        left = [c for c in self._searchable if c not in knowledge.first_seen and c != container]
        targets = [part.at for part in _leaves(self._goal)]
        ends = [
            self._index[p] for p in (*left, *targets, LocationId(container), *knowledge.items_at) if p in self._index
        ]
        if not ends:
            return max(self._failure, own_cost)
        among = self._metres[np.ix_(ends, ends)]
        into = among.max(axis=0)
        looks = float(into[: len(left)].sum()) + self._costs.search * len(left)
        longest = float(among.max())
        fetches = self.most_picks * (2 * longest + 2 * self._costs.manipulation)
        return max(self._failure, own_cost + looks + fetches)


def _plain(goal: Goal) -> bool:
    """Only deliveries and finds: no preparation, so each part needs one fetch."""
    return all(isinstance(leaf, Holding) or not leaf.properties for leaf in _leaves(goal))


def _leaves(goal: Goal) -> tuple[Delivered | Holding, ...]:
    if isinstance(goal, AllOf | AnyOf):
        return tuple(leaf for part in goal.parts for leaf in _leaves(part))
    return (goal,)
