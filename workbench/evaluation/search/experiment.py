"""Running all trials of the object-search experiment, house by house, on several processes.

A trial depends only on its house, item type and policy, so the number of workers affects only the running time.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from workbench.beliefs.belief import Estimator
from workbench.errors import BadValue, LiosError
from workbench.evaluation.beliefs.fold_weights import Believers
from workbench.evaluation.search.table import GREEDY
from workbench.evaluation.search.trials import (
    ASKS_NO_BELIEF,
    ORACLE,
    PAPER_POLICY,
    SearchTrial,
    house_trials,
    queries,
)
from workbench.plugins import NameOrigin
from workbench.process_pool import process_pool
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.search.policies.registry import canonical_policy, policy, policy_names
from workbench.worlds.house import Contents, FloorPlan, House, ItemType
from workbench.worlds.maps.navigation import navigate

WAITING_A_WORKER = 3
"""Houses queued ahead, which bounds memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """The policies and estimators under comparison.

    Attributes:
        policies: names, with greedy first and the oracle last, which every table needs.
        estimator: the estimator of the policies.
        paper_estimator: the estimator of the paper's policy, lios.
        believers: the weights of both for each house, if retrained per fold.
    """

    policies: tuple[str, ...]
    estimator: str
    paper_estimator: str
    costs: ActionCosts = SIMULATION_COSTS
    believers: Believers = field(default_factory=Believers)

    def estimators(self) -> tuple[str, ...]:
        """The estimator names in use."""
        asking = [name for name in self.policies if name not in ASKS_NO_BELIEF]
        return tuple(dict.fromkeys(self._estimator_of(name) for name in asking))

    def estimator_for(self, name: str, house: str) -> str:
        """The estimator of a policy in a house: a name or a weights file."""
        return self.believers.of(self._estimator_of(name), house)

    def _estimator_of(self, name: str) -> str:
        return self.paper_estimator if name == PAPER_POLICY else self.estimator


@dataclass(frozen=True, slots=True, kw_only=True)
class HouseResult:
    """The trials of one house, or the reason why there are none."""

    house: str
    trials: tuple[SearchTrial, ...]
    skipped: str = ""


def policies_named(names: Sequence[str]) -> tuple[str, ...]:
    """The policies of an experiment: the named ones or all, with greedy first and the oracle last.

    Raises:
        UnknownName: a policy does not exist.
    """
    wanted = policy_names() if "all" in [n.lower() for n in names] else tuple(names)
    chosen = [_checked(name) for name in wanted if name.lower() not in (GREEDY, ORACLE)]
    return (GREEDY, *dict.fromkeys(chosen), ORACLE)


def run_experiment(
    experiment: Experiment,
    houses: Iterable[House],
    *,
    asked: Mapping[str, tuple[ItemType, ...]] | None = None,
    workers: int = 1,
) -> Iterator[HouseResult]:
    """Every policy on every query of every house, in the houses' order.

    Args:
        asked: item types by house; None for all. Houses without an entry are left out.
        workers: number of processes; 1 runs in this process.

    Raises:
        BadValue: fewer than one worker.
    """
    if workers < 1:
        raise BadValue("workers", workers, "at least 1")
    chosen = ((house, None if asked is None else asked.get(house.plan.name, ())) for house in houses)
    jobs = ((experiment, h.plan, dict(h.contents), items) for h, items in chosen if items is None or items)
    if workers == 1:
        yield from (_house(*job) for job in jobs)
        return
    with process_pool(workers, initializer=_one_thread) as pool:
        waiting: deque[Future[HouseResult]] = deque()
        for job in jobs:
            waiting.append(pool.submit(_house, *job))
            if len(waiting) >= workers * WAITING_A_WORKER:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def draw_queries(houses: Iterable[House], count: int, *, rng: np.random.Generator) -> dict[str, tuple[ItemType, ...]]:
    """Queries drawn at random among all pairs of house and item type, without replacement.

    Args:
        count: number of queries; at most all.

    Raises:
        BadValue: a count below 1.
    """
    if count < 1:
        raise BadValue("queries", count, "at least 1, or all")
    pairs = [(h.plan.name, item) for h in houses for item in _queries_or_none(h)]
    chosen = sorted(rng.permutation(len(pairs))[:count].tolist())
    asked: dict[str, tuple[ItemType, ...]] = {}
    for i in chosen:
        house, item = pairs[i]
        asked[house] = (*asked.get(house, ()), item)
    return asked


def _queries_or_none(house: House) -> tuple[ItemType, ...]:
    try:
        return queries(house, navigate(house.plan).travel)
    except LiosError:
        return ()


def _checked(name: str) -> str:
    policy(name, origin=NameOrigin.USER)
    return canonical_policy(name) or name


def _house(
    experiment: Experiment, plan: FloorPlan, contents: Contents, items: tuple[ItemType, ...] | None
) -> HouseResult:
    try:
        travel = navigate(plan).travel
        trials = house_trials(
            House(plan=plan, contents=contents),
            travel,
            policies=experiment.policies,
            estimators=lambda name: _estimator(experiment.estimator_for(name, plan.name)),
            costs=experiment.costs,
            item_types=items,
        )
    except LiosError as error:
        return HouseResult(house=plan.name, trials=(), skipped=str(error))
    return HouseResult(house=plan.name, trials=tuple(trials))


@lru_cache(maxsize=32)
def _estimator(name: str) -> Estimator:
    from workbench.beliefs.estimators import estimator

    return estimator(name, origin=NameOrigin.USER)


def _one_thread() -> None:
    """Limit a worker to one thread, since the processes share the cores already."""
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"
