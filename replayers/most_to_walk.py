"""What can a run still cost at most, in the unluckiest of the worlds that agree with the log?

Two bounds from above. One holds for every strategy: the step limit ends a run, and no step costs more than the
longest way. The other holds for strategies that go *straight*: between two looks they only fetch what a part of
the goal asks for and bring it there, each part once; and they do not give up while all that is needed can be found.
Every run that is explored is checked against that; a strategy that breaks it is left with the first bound.
"""

from __future__ import annotations

from typing import final

import numpy as np

from replayers.evidence import Evidence
from replayers.relevance import most_instances
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import LocationId
from workbench.worlds.knowledge import Knowledge


@final
class MostToWalk:
    """The bounds for one log and one task."""

    def __init__(self, evidence: Evidence, *, max_steps: int) -> None:
        travel = evidence.place.travel
        self._metres = np.asarray(travel.metres)
        self._index = {name: i for i, name in enumerate(travel.locations)}
        self._costs = evidence.costs
        self._goal = evidence.task.goal
        self._max_steps = max_steps
        self._searchable = tuple(LocationId(c) for c in (*evidence.contents, *evidence.open, *evidence.shut))
        self.fits_straight = _plain(self._goal)
        self.most_picks = most_instances(self._goal)

    def by_step_limit(self) -> float:
        """For every strategy: the cost of a run, wherever it is now."""
        dearest = max(float(self._metres.max(initial=0.0)), self._costs.manipulation, self._costs.search)
        return self._max_steps * dearest

    def going_straight(self, knowledge: Knowledge) -> float:
        """For strategies that go straight, from a state on: every look that is left, and every fetch.

        Each look is charged its dearest way in, from wherever such a run can come.
        """
        left = [c for c in self._searchable if c not in knowledge.first_seen and c in self._index]
        parts = [part for part in _leaves(self._goal) if not is_met(part, knowledge)]
        targets = [part.at for part in _leaves(self._goal) if part.at in self._index]
        wanted = {part.item_type for part in parts}
        sources = [at for t in sorted(wanted) for at, _ in knowledge.where(t)]
        here = [knowledge.robot_at] if knowledge.robot_at in self._index else []
        ends = [self._index[p] for p in dict.fromkeys((*left, *targets, *sources, *here))]
        if not ends:
            return 0.0
        among = self._metres[np.ix_(ends, ends)]
        looks = float(among.max(axis=0)[: len(left)].sum()) + self._costs.search * len(left)
        count = min(self.most_picks, len(parts))
        return looks + count * (2 * float(among.max()) + 2 * self._costs.manipulation)


def _plain(goal: Goal) -> bool:
    """Only deliveries and finds: no preparation, so each part needs one fetch."""
    return all(isinstance(leaf, Holding) or not leaf.properties for leaf in _leaves(goal))


def _leaves(goal: Goal) -> tuple[Delivered | Holding, ...]:
    if isinstance(goal, AllOf | AnyOf):
        return tuple(leaf for part in goal.parts for leaf in _leaves(part))
    return (goal,)
