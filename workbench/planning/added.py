"""Where may that stand which the scenario itself has put into the house? No house teaches it; the task says it.

Coffee adds grinds and a water bottle, a scenario file whatever it lists. They stand in a container of the types that
the scenario names, each as likely as another. An estimator that has learnt from houses without them can only guess
from their names: to ours a water bottle stood beside the toilet, hardly ever in the fridge. Like what exists
(Task.available), this is prior knowledge, the same for every strategy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.beliefs.belief import Belief
from workbench.planning.tasks import Task
from workbench.worlds.house import FloorPlan


def with_added(belief: Belief, task: Task, plan: FloorPlan) -> Belief:
    """The belief with even chances for what the task says was added, over the containers where it may still be.

    An item for which no such container is left unsearched keeps the estimator's row.
    """
    stands = {added.item_type: added.stands for added in task.added if added.item_type in belief.item_types}
    if not stands:
        return belief
    type_of = {container.id: container.type for container in plan.containers}
    probability = belief.probability.copy()
    for item_type, types in stands.items():
        fitting = np.array([type_of.get(container) in types for container in belief.containers], dtype=np.float64)
        if fitting.any():
            probability[belief.item_types.index(item_type)] = fitting / fitting.sum()
    return replace(belief, probability=probability)
