"""Which known items a strategy may still fetch; one that is the nearest of its type from nowhere is not among them.

A task that needs one cup leaves all others where they are. A strategy whose plans go by distance alone takes the one
that costs least on the path from where it stands to where the cup is wanted. It decides only after looks: where it is
now and, as long as something is missing, at containers that are left; between errands it is where the goal wants
things, unless it puts something down on the way. A cup that is the nearest from none of these places is never
fetched, and no plan goes by it. So states that differ in such cups alone go on alike, and there are far fewer others:
how many containers hold a second cup no longer multiplies them.

Two things such cups can change: which of several plans of equal cost is found first, and plans that put something
down on the way (put_down.py). Whether plans are equal, and bounds of the others, do not depend on the cups, and few
are. Where some are equal, or where it may be worth while to put something down, the run is followed no further in
this tree; if it decides a bound, or a world leads there, it is followed where all items are told apart
(RunTree.with_all_items).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, final

import numpy as np

from replayers.counterfactual.evidence import Evidence, is_plain
from workbench.arrays import Bools, Floats, Indices, Ints
from workbench.caches import PerObject
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import Delivered, distinct_deliveries
from workbench.search.policies.nearest_first import NearestFirst
from workbench.search.policy import SearchPolicy
from workbench.tolerances import NEAR_COST, TINY
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, Places
from workbench.worlds.travel import shortest_paths

if TYPE_CHECKING:
    from replayers.counterfactual.decisions.one_plan import OnePlanRules

MAX_PARTS = 5
"""With more parts of the goal, there are too many orders in which they can be brought."""


def needed_items(evidence: Evidence, policy: SearchPolicy | None) -> NeededItems | None:
    """Which items are needed over a log; None where another than the nearest may be fetched: where actions were
    refused, looks may miss, things come into view on the way, or a path through a third place is shorter.

    Args:
        policy: by which the strategy looks, where its plans go by distance alone.
    """
    parts = distinct_deliveries(evidence.task.goal)
    if policy is None or not is_plain(evidence) or not 0 < len(parts) <= MAX_PARTS:
        return None
    metres = evidence.place.travel.metres
    is_metric = _METRIC.of(metres).get(TINY, lambda: _is_metric(metres))
    if not is_metric or evidence.costs.manipulation <= NEAR_COST:
        return None
    index = {name: i for i, name in enumerate(evidence.place.travel.locations)}
    if any(part.at not in index for part in parts):
        return None
    handle, unopened = evidence.costs.manipulation, tuple(evidence.open)
    return NeededItems(parts, metres, index, handle, unopened, any_first=isinstance(policy, NearestFirst))


_METRIC: PerObject[float, bool] = PerObject(2)
"""By distances, whether they are a metric."""


def _is_metric(metres: Floats) -> bool:
    """Whether no path through a third place is shorter, and every way back as long."""
    return all(np.allclose(metres, other, rtol=0, atol=TINY) for other in (shortest_paths(metres), metres.T))


@final
class NeededItems:
    """The needed items for one log and one task: deliveries of different types, as they are.

    Args:
        unopened: the containers that nobody opened.
        any_first: where the strategy looks does not depend on what it seeks.
    """

    def __init__(
        self,
        parts: tuple[Delivered, ...],
        metres: Floats,
        index: dict[LocationId, int],
        manipulation: float,
        unopened: Collection[ContainerId],
        *,
        any_first: bool,
    ) -> None:
        self._parts = parts
        self._metres = metres
        self._index = index
        self._manipulation = manipulation
        self._open = frozenset(unopened)
        self._any_first = any_first
        self._ends = [index[part.at] for part in parts]
        self._errands = {part.item_type: metres + metres[:, index[part.at]] for part in parts}
        self._rules: OnePlanRules | None = None
        self._left: tuple[ContainerId, ...] = ()
        self._places_left: list[int] = []

    def of(self, item_type: ItemType, knowledge: Knowledge) -> Places:
        """The known instances of a type that may still be fetched, and those that cannot be reached."""
        known = knowledge.where(item_type)
        if len(known) < 2 or knowledge.holding is not None or item_type not in self._errands:
            return known
        here, at = self._index.get(knowledge.robot_at), [self._index.get(place, -1) for place, _ in known]
        if here is None or min(at) < 0:
            return known
        begin = [here, *self._ends]
        if self._some_missing(knowledge):
            begin += self._where_left(knowledge)
        needed = _least_for_some(_from_to(self._errands[item_type], begin, at))
        return tuple([place for place, is_needed in zip(known, needed.tolist(), strict=True) if is_needed])

    def one_plan_is_best(self, knowledge: Knowledge) -> bool:
        """Whether all plans of least cost do the same until they see something new, or to their ends, and none that
        puts something down on the way is cheaper, whichever items are known that are not needed.

        Where no open container was looked into, there is one history only.
        """
        here = self._index.get(knowledge.robot_at)
        if self._open.isdisjoint(knowledge.first_seen):
            return True
        if here is None or knowledge.holding is not None:
            left = [part for part in self._parts if not is_met(part, knowledge)]
            is_stuck = any(self._is_missing(part, knowledge) for part in left) and not self._where_left(knowledge)
            return len(left) < 2 or is_stuck
        known = [
            [self._index[at] for at, _ in knowledge.where(part.item_type) if at in self._index]
            for part in self._parts
        ]
        most = max(1, *map(len, known))
        at = np.array([[*places, *[-1] * (most - len(places))] for places in known])
        return self.one_plan_is_best_at(here, at, np.array(self._where_left(knowledge), dtype=np.intp), knowledge)

    def one_plan_is_best_at(self, here: int, at: Ints, left: Indices, knowledge: Knowledge) -> bool:
        """The same of a state whose arrays are made; arguments as of one_plan.one_plan_is_best."""
        from replayers.counterfactual.decisions.one_plan import one_plan_is_best

        if self._open.isdisjoint(knowledge.first_seen):
            return True
        return one_plan_is_best(self.rules, here, at, left, self._looked(knowledge))

    @property
    def rules(self) -> OnePlanRules:
        """What the test goes by, for the compiled code."""
        from replayers.counterfactual.decisions.one_plan import OnePlanRules
        from replayers.counterfactual.decisions.put_down import put_down_plans

        if self._rules is None:
            self._rules = OnePlanRules(
                metres=self._metres,
                errands=np.array([self._errands[part.item_type] for part in self._parts]),
                wanted=np.array(self._ends),
                manipulation=float(self._manipulation),
                any_first=self._any_first,
                plans=put_down_plans(),
            )
        return self._rules

    def _looked(self, knowledge: Knowledge) -> Indices:
        """The location indices of the open containers that were looked into."""
        return np.array([self._index[LocationId(c)] for c in knowledge.first_seen if c in self._open], dtype=np.intp)

    def _some_missing(self, knowledge: Knowledge) -> bool:
        return any(self._is_missing(part, knowledge) for part in self._parts)

    def _is_missing(self, part: Delivered, knowledge: Knowledge) -> bool:
        """Whether it is sought: no item is known, or none that can be reached."""
        return not any(at in self._index for at, _ in knowledge.where(part.item_type))

    def _where_left(self, knowledge: Knowledge) -> list[int]:
        """The location indices of the containers that are left; most states that follow one another share them."""
        if knowledge.unsearched != self._left:
            self._left = knowledge.unsearched
            self._places_left = [self._index[LocationId(c)] for c in self._left]
        return self._places_left


def _from_to(table: Floats, rows: list[int], columns: list[int]) -> Floats:
    """A part of a table: np.ix_ in a third of its time."""
    return table.take(rows, axis=0).take(columns, axis=1)


def _least_for_some(costs: Floats) -> Bools:
    """Which of several costs (columns) is within a tolerance of the least from some place (rows)."""
    least = costs.min(axis=1, keepdims=True)
    return (costs <= least + NEAR_COST * np.maximum(1.0, least)).any(axis=0)
