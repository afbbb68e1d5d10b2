"""Runs whose beliefs differ by roundings alone: the same actions, whatever strategy, goal and estimator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.estimators import estimator as estimator_named
from workbench.evaluation.tasks.trials import PreparedTrial, TrialKey, prepare_trial
from workbench.execution.events import ActionEnded, ContainerObserved, RunEnded
from workbench.execution.loop import run_task
from workbench.planning.strategies import STRATEGIES, VARIANTS, strategy
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.shipped import shipped_houses
from workbench.worlds.simulated import SimulatedWorld

NOISE = 1e-12
SOMEWHERE = 1e-6
"""Rows whose beliefs add up to less say so little that roundings are a part of what they say."""

ALL = (*STRATEGIES, *VARIANTS)


@dataclass(frozen=True)
class Coarse:
    """An estimator whose chances are multiples of `step`, or all the same: most containers are as good as others."""

    base: Estimator
    step: float
    name: str = "coarse"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        exact = self.base.believe(knowledge, item_types)
        p = exact.probability
        stepped = np.round(p / self.step) * self.step if self.step else np.full_like(p, 0.1)
        return replace(exact, probability=np.clip(stepped, 0.0, 1.0), estimator=self.name)


@dataclass(frozen=True)
class Noisy:
    """The base's belief, every chance off by up to 1e-12 of itself and, where something is believed, by 1e-12."""

    base: Estimator
    seed: int
    name: str = "noisy"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        exact = self.base.believe(knowledge, item_types)
        rng = np.random.default_rng((self.seed, len(exact.containers)))
        p = exact.probability
        relative, absolute = rng.uniform(-NOISE, NOISE, (2, *p.shape))
        said = p.max(axis=1, keepdims=True, initial=0.0) > SOMEWHERE
        return replace(exact, probability=np.clip(p * (1 + relative) + np.where(said, absolute, 0.0), 0.0, 1.0))


@lru_cache
def staged(scenario: str, house: int) -> PreparedTrial:
    return prepare_trial(
        TrialKey(scenario=scenario, trial=0, houses=str(shipped_houses()), house_index=house, seed=3 + house)
    )


def run(trial: PreparedTrial, name: str, estimator: Estimator) -> list[Any]:
    """What is done and seen, and how it ends."""
    world = SimulatedWorld(trial.house, trial.navigation, known=trial.known)
    planner = strategy(name, house=trial.house)
    events = run_task(world, planner, estimator, trial.task, costs=trial.costs, seed=7)
    return [_fact(e) for e in events if isinstance(e, ActionEnded | ContainerObserved | RunEnded)]


def _fact(event: ActionEnded | ContainerObserved | RunEnded) -> Any:
    if isinstance(event, ActionEnded):
        return event.step.action, event.step.origin, event.step.target, event.step.items
    if isinstance(event, ContainerObserved):
        return event.container
    return event.status, event.cost


@pytest.mark.ci_but(10)
@pytest.mark.parametrize("step", [0.0, 0.1], ids=["all the same", "in tenths"])
@pytest.mark.parametrize("scenario", ["deliver-1", "deliver-3", "any-of-3", "breakfast"])
@pytest.mark.parametrize("name", ALL)
def test_beliefs_off_by_a_rounding_give_the_same_run(name: str, scenario: str, step: float) -> None:
    trial = staged(scenario, 0)
    ties = Coarse(estimator_named("counts"), step)
    exact = run(trial, name, ties)
    assert len(exact) > 1
    for seed in range(3):
        assert run(trial, name, Noisy(ties, seed)) == exact, f"noise of seed {seed}"
