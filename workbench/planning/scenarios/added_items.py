"""Beliefs over items that the scenario itself has added to the house: uniform over the container types that it
names.

The coffee scenarios add coffee grinds and a water bottle; a scenario file adds whatever it lists. Each stands in a
container of the types that the scenario names, all equally likely. Estimators are trained on houses without these
items and could only guess from their names (ours put water bottles in bathrooms). Like the set of existing types
(Task.available), this is prior knowledge that every strategy gets.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.beliefs.belief import Belief
from workbench.planning.tasks import Task
from workbench.worlds.house import FloorPlan


def believe_scenario_items(belief: Belief, task: Task, plan: FloorPlan) -> Belief:
    """The belief with a uniform row for each item that the task has added, over the containers where it may still
    be.

    If no such container is left unsearched, the item keeps the estimator's row.
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
