"""Warm-up: loads and compiles everything that the first decision needs, once per process, before time is measured.

The built-in solver and the find costs are compiled at their first use on a machine, which may exceed a planning
budget; later their machine code is loaded from disk in half a second.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from workbench.beliefs.asking.answered_estimator import AnsweredEstimator
from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.guarded_estimator import GuardedEstimator
from workbench.planning.strategy import View
from workbench.planning.tasks import Delivered, Task
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge

COMPILING_S = 3600.0
"""The planning budget of a warm-up: were it spent while the solver compiles, no rollouts would be compiled."""


def warm_up(knowledge: Knowledge, estimator: Estimator, item_types: tuple[ItemType, ...]) -> None:
    """Compute a belief and a plan once for the current house, and discard the results.

    Runs once per estimator and process; further calls do nothing. An estimator from outside is not asked: its answer
    may cost something, and its time counts.
    """
    if estimator.name not in _warmed_estimators() and knowledge.unsearched:
        if not isinstance(estimator, AnsweredEstimator | GuardedEstimator):
            estimator.believe(knowledge, item_types)
        _warmed_estimators().add(estimator.name)
        _plan_once(knowledge)


@cache
def _warmed_estimators() -> set[str]:
    """The estimators that have been warmed up in this process."""
    return set()


def _plan_once(knowledge: Knowledge) -> None:
    """Bring a thing to where the robot stands, as these two would: together they use all that is compiled."""
    from workbench.planning.strategies import strategy
    from workbench.plugins import NameOrigin

    knowledge = Knowledge(plan=knowledge.plan, travel=knowledge.travel)  # a known item may be unreachable
    kind = ItemType("Mug")
    belief = Belief(
        item_types=(kind,),
        containers=knowledge.unsearched,
        probability=np.full((1, len(knowledge.unsearched)), 0.5),
        estimator="none",
    )
    goal = Delivered(item_type=kind, at=knowledge.robot_at)
    task = Task(scenario="none", goal=goal, failure_cost=0.0, budget_s=COMPILING_S)
    view = View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION_COSTS, budget_s=COMPILING_S)
    for name in ("scout-lios", "model-lios-per-find"):
        strategy(name, origin=NameOrigin.USER).decide(view)
