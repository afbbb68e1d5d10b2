"""What must be loaded or compiled before the first decision? Done once a process, before any clock runs.

The built-in solver and the find costs are compiled at their first use on a machine, which may take longer than a
planning budget; later their machine code is loaded from disk, which takes half a second.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.strategy import View
from workbench.planning.tasks import Delivered, Task
from workbench.search.costs import SIMULATION
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge


def warm_up(knowledge: Knowledge, estimator: Estimator, item_types: tuple[ItemType, ...]) -> None:
    """Believes and plans once, with the place that the robot is in, and throws the answers away.

    A process does this once for each estimator; further calls do nothing.
    """
    if estimator.name not in _warm() and knowledge.unsearched:
        estimator.believe(knowledge, item_types)
        _warm().add(estimator.name)
        _plan_once(knowledge)


@cache
def _warm() -> set[str]:
    """The estimators that have been used in this process."""
    return set()


def _plan_once(knowledge: Knowledge) -> None:
    """Bring a thing to where the robot stands, as these two would: together they use all that is compiled."""
    from workbench.planning.strategies import strategy
    from workbench.plugins import NameOrigin

    knowledge = Knowledge(plan=knowledge.plan, travel=knowledge.travel)  # a known thing may be out of reach
    kind = ItemType("Mug")
    belief = Belief(
        item_types=(kind,),
        containers=knowledge.unsearched,
        probability=np.full((1, len(knowledge.unsearched)), 0.5),
        estimator="none",
    )
    goal = Delivered(item_type=kind, at=knowledge.robot_at)
    task = Task(scenario="none", goal=goal, failure_cost=0.0, budget_s=1.0)
    view = View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION, budget_s=1.0)
    for name in ("scout-lios", "model-lios-per-find"):
        strategy(name, origin=NameOrigin.USER).decide(view)
