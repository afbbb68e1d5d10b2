"""The set-up of a run from a task, names and a seed, in simulation and on a robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from workbench.beliefs.belief import Estimator
from workbench.beliefs.estimators import estimator as estimator_named
from workbench.beliefs.memory.memory import Memory
from workbench.beliefs.memory.memory_estimator import with_memory
from workbench.execution.events import Event
from workbench.execution.loop import run_task
from workbench.planning.strategies import strategy as strategy_named
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin
from workbench.search.costs import ActionCosts
from workbench.worlds.house import House
from workbench.worlds.perception import PERFECT, Perception
from workbench.worlds.world import World


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSetup:
    """A run without its world, with all names resolved.

    Attributes:
        seed: passed to the strategy.
        perception: how surely a look shows what is there, as the robot believes it.
    """

    task: Task
    strategy: Strategy
    estimator: Estimator
    costs: ActionCosts
    seed: int = 0
    perception: Perception = PERFECT

    def events(self, world: World) -> Iterator[Event]:
        """Run it in a world, as run_task."""
        return run_task(
            world,
            self.strategy,
            self.estimator,
            self.task,
            costs=self.costs,
            seed=self.seed,
            perception=self.perception,
        )


def set_up(
    task: Task,
    *,
    strategy: str | Strategy,
    estimator: str | Estimator,
    costs: ActionCosts,
    seed: int = 0,
    house: House | None = None,
    perception: Perception = PERFECT,
    memory: Memory | None = None,
) -> RunSetup:
    """Resolve the names that a user gives; what is given itself is taken as it is.

    Args:
        house: the truth, for the oracle alone.
        perception: as in RunSetup.
        memory: of earlier runs, by which the estimator goes as well.

    Raises:
        UnknownName, NotFromLog, PluginNotLoaded, MissingExtra: as `strategy` and `estimator`.
    """
    if isinstance(strategy, str):
        strategy = strategy_named(strategy, origin=NameOrigin.USER, house=house)
    if isinstance(estimator, str):
        estimator = estimator_named(estimator, origin=NameOrigin.USER)
    estimator = with_memory(estimator, memory)
    return RunSetup(task=task, strategy=strategy, estimator=estimator, costs=costs, seed=seed, perception=perception)
