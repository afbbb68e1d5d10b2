"""What must be loaded or compiled before the first decision? Done once a process, before any clock runs.

The built-in solver and the find costs are compiled at their first use on a machine, which may take longer than a
planning budget; later their machine code is loaded from disk, which takes half a second.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.built_in import solve
from workbench.planning.find_pricing import Expected, FindQuestion
from workbench.planning.problem import problem_of
from workbench.planning.tasks import Delivered
from workbench.search.costs import SIMULATION
from workbench.search.policies import policy
from workbench.search.policy import SearchQuery
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
    """Bring a thing from where the robot stands to where it stands."""
    knowledge = Knowledge(plan=knowledge.plan, travel=knowledge.travel)  # a known thing may be out of reach
    here, kind = knowledge.robot_at, ItemType("Mug")
    belief = Belief(
        item_types=(kind,),
        containers=knowledge.unsearched,
        probability=np.full((1, len(knowledge.unsearched)), 0.5),
        estimator="none",
    )
    question = FindQuestion(
        belief=belief, travel=knowledge.travel, origins=(here,), targets=(here,), costs=SIMULATION
    )
    goal = Delivered(item_type=kind, at=here)
    problem = problem_of(
        goal, knowledge, SIMULATION, locations=(here,), find_costs=Expected(belief_model="exists").price(question)
    )
    solve(problem)
    query = SearchQuery(
        item_type=kind, origin=here, target=here, belief=belief, travel=knowledge.travel, costs=SIMULATION
    )
    policy("full-lios").order(query)
