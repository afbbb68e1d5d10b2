"""The start of a task in a house: its items, and the containers that the robot knows, at most 20 % of all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.errors import BadValue
from workbench.planning.scenarios.paper import make_task, with_scenario_items
from workbench.planning.tasks import Task
from workbench.worlds.house import ContainerId, FloorPlan, House
from workbench.worlds.travel import TravelCosts

MAX_KNOWN_SHARE = 0.2
"""At most this share of the containers is known at the start (docs/architecture.md)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskStart:
    """A task in a house, before its first step.

    Attributes:
        house: the truth, with what the scenario adds.
        known: containers whose contents the robot knows.
    """

    house: House
    task: Task
    known: tuple[ContainerId, ...]


def scenario_start(
    scenario: str, house: House, *, seed: int, travel: TravelCosts | None = None, max_known: float = MAX_KNOWN_SHARE
) -> TaskStart:
    """The start of a scenario in a house; the same seed gives the same.

    Args:
        scenario: a name of the paper's, or a scenario file.
        travel: if given, the task names only what can be reached.
        max_known: largest share of containers known at the start.

    Raises:
        UnknownName: no such scenario.
        ScenarioUnsupported: the house lacks something.
    """
    house = with_scenario_items(scenario, house, seed=seed)
    task = make_task(scenario, house, seed=seed, travel=travel)
    known = known_at_start(house.plan, rng=np.random.default_rng(seed), max_known=max_known)
    return TaskStart(house=house, task=task, known=known)


def known_at_start(
    plan: FloorPlan, *, rng: np.random.Generator, max_known: float = MAX_KNOWN_SHARE
) -> tuple[ContainerId, ...]:
    """Draw the containers whose contents are known, in the plan's order.

    The number is uniform between 0 and the given share of the containers, rounded down.

    Raises:
        BadValue: a share outside [0, 1].
    """
    if not 0 <= max_known <= 1:
        raise BadValue("share of containers known at the start", max_known, "within [0, 1]")
    containers = [container.id for container in plan.containers]
    count = int(rng.integers(0, int(max_known * len(containers)) + 1))
    chosen = set(rng.choice(len(containers), size=count, replace=False).tolist()) if count else set[int]()
    return tuple(c for i, c in enumerate(containers) if i in chosen)
