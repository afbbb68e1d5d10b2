"""What can a run still cost at most, in the unluckiest of the worlds that agree with the log?

Two bounds from above. One holds for every strategy: the step limit ends a run, and no step costs more than the
longest way. The other holds for strategies that go *straight*: between two looks they only fetch what a part of
the goal asks for and bring it there, each part once; and they do not give up while all that is needed can be found.
Every run that is explored is checked against that; a strategy that breaks it is left with the first bound.
"""

from __future__ import annotations

from typing import final

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from replayers.evidence import Evidence
from replayers.relevance import most_instances
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import LocationId
from workbench.worlds.knowledge import Knowledge

Floats = npt.NDArray[np.float64]


@final
class MostToWalk:
    """The bounds for one log and one task."""

    def __init__(self, evidence: Evidence, *, max_steps: int) -> None:
        travel = evidence.place.travel
        self._metres: Floats = np.asarray(travel.metres)
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

        Such a run is a chain of legs: into a container to look, to an item to pick it, to a place to bring it. A leg
        to a look or to an item starts where the leg before ended: here, at a look (each is made once), or where a
        part was brought (once a part). So the dearest way to give each of these legs a start of its own is at least
        what they can come to (an assignment problem); to it comes the dearest way to bring each part.
        """
        looks = [self._index[c] for c in self._searchable if c not in knowledge.first_seen and c in self._index]
        parts = [part for part in _leaves(self._goal) if not is_met(part, knowledge) and part.at in self._index]
        sources = [self._sources(part, knowledge, looks) for part in parts]
        here = [self._index[knowledge.robot_at]] if knowledge.robot_at in self._index else []
        starts = [*here, *looks, *(self._index[part.at] for part in parts)]
        if not starts:
            return 0.0
        among = self._metres[starts]
        to_items = [among[:, at].max(axis=1) if at else np.zeros(len(starts)) for at in sources]
        brought = [
            float(self._metres[at, self._index[part.at]].max()) if at else 0.0
            for part, at in zip(parts, sources, strict=True)
        ]
        fetches = min(self.most_picks, len(parts))
        legs = np.array([*(among[:, look] for look in looks), *_dearest(to_items, fetches)])
        rows, columns = linear_sum_assignment(legs, maximize=True) if legs.size else ((), ())
        carried = sum(sorted(brought, reverse=True)[:fetches]) + 2 * fetches * self._costs.manipulation
        return float(legs[rows, columns].sum() if legs.size else 0.0) + self._costs.search * len(looks) + carried

    def _sources(self, part: Delivered | Holding, knowledge: Knowledge, looks: list[int]) -> list[int]:
        """Where an instance for a part may be picked up or is in hand: known, or in a container that is left."""
        held = knowledge.holding is not None and knowledge.holding.type == part.item_type
        places = [at for at, _ in knowledge.where(part.item_type)]
        places += [knowledge.robot_at] if held else []
        known = [self._index[at] for at in dict.fromkeys(places) if at in self._index]
        return [*known, *(look for look in looks if look not in known)]


def _dearest(to_items: list[Floats], count: int) -> list[Floats]:
    """For `count` fetches of whichever parts: per start, the dearest way to an item, so often."""
    if len(to_items) <= count:
        return to_items
    return [np.max(to_items, axis=0)] * count


def _plain(goal: Goal) -> bool:
    """Only deliveries and finds: no preparation, so each part needs one fetch."""
    return all(isinstance(leaf, Holding) or not leaf.properties for leaf in _leaves(goal))


def _leaves(goal: Goal) -> tuple[Delivered | Holding, ...]:
    if isinstance(goal, AllOf | AnyOf):
        return tuple(leaf for part in goal.parts for leaf in _leaves(part))
    return (goal,)
