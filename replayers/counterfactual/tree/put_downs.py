"""Items put down on the way: a run that does so carries one of them twice, so that bounds for runs that carry
everything straight to where it is wanted (upper_bound.py) say nothing of it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from workbench.planning.plans import PlanStep
from workbench.planning.tasks import Goal, plain_deliveries
from workbench.worlds.house import ItemType, LocationId

Destinations = Mapping[ItemType, frozenset[LocationId]]


def destinations(goal: Goal) -> Destinations:
    """Where a goal wants each of its types, for plain deliveries; empty for other goals: things are brought together
    on the way there."""
    plain = plain_deliveries(goal)
    types = {part.item_type for part in plain}
    return MappingProxyType({t: frozenset(part.at for part in plain if part.item_type == t) for t in types})


def is_put_down(step: PlanStep, wanted: Destinations) -> bool:
    """Whether a step puts an item down where the goal does not want it."""
    if step.action != "place" or not step.item_types or step.item_types[0] not in wanted:
        return False
    return step.target not in wanted[step.item_types[0]]
