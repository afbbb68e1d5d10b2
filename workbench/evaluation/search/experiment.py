"""Running all trials of the object-search experiment, house by house, on several processes.

A trial depends only on its house, item type and policy, so the number of workers affects only the running time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

import numpy as np

from workbench.beliefs.belief import Estimator
from workbench.errors import BadValue, LiosError
from workbench.evaluation.beliefs.fold_weights import FoldEstimators
from workbench.evaluation.cluster import run_in_order
from workbench.evaluation.failed_estimator import ESTIMATOR_FAULTS
from workbench.evaluation.search.missed_looks import START_OVER, MissedLooks, draw_of, search_with_misses
from workbench.evaluation.search.table import GREEDY
from workbench.evaluation.search.trials import (
    ASKS_NO_BELIEF,
    ORACLE,
    PAPER_POLICY,
    SearchTrial,
    house_trials,
    queries,
)
from workbench.evaluation.stored_results import StoredResults, content_of, key_of, run_resumable
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS, ActionCosts
from workbench.search.policies.oracle import oracle_policy
from workbench.search.policies.registry import WHERE_LOOKS_MISS, canonical_policy, policy, policy_names
from workbench.worlds.house import Contents, FloorPlan, House, ItemType
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.travel import TravelCosts


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """The policies and estimators under comparison.

    Attributes:
        policies: names, with greedy first and the oracle last, which every table needs.
        estimator: the estimator of the policies.
        paper_estimator: the estimator of the paper's policy, lios.
        fold_estimators: the weights of both for each house, if retrained per fold.
        miss_rate: the chance that a look misses an item; where it is not 0, POLICY@start-over is a policy, too.
        seed: of the draws of misses.
    """

    policies: tuple[str, ...]
    estimator: str
    paper_estimator: str
    costs: ActionCosts = SIMULATION_COSTS
    fold_estimators: FoldEstimators = field(default_factory=FoldEstimators)
    miss_rate: float = 0.0
    seed: int = 0

    def estimators(self) -> tuple[str, ...]:
        """The estimator names in use."""
        asking = [name for name in self.policies if base_policy(name) not in ASKS_NO_BELIEF]
        return tuple(dict.fromkeys(self._estimator_of(name) for name in asking))

    def estimator_for(self, name: str, house: str) -> str:
        """The estimator of a policy in a house: a name or a weights file."""
        return self.fold_estimators.of(self._estimator_of(name), house)

    def _estimator_of(self, name: str) -> str:
        return self.paper_estimator if base_policy(name) == PAPER_POLICY else self.estimator

    def misses_of(self, name: str, house: str, item_type: ItemType) -> MissedLooks:
        """How looks miss in the trial of a policy; the draws are the same for all policies."""
        rate = 0.0 if name == ORACLE else self.miss_rate
        return MissedLooks(rate=rate, seed=draw_of(self.seed, house, item_type), start_over=name.endswith(START_OVER))


_Job: TypeAlias = "tuple[Experiment, FloorPlan, Contents, tuple[ItemType, ...] | None]"


@dataclass(frozen=True, slots=True, kw_only=True)
class HouseResult:
    """The trials of one house, or the reason why there are none."""

    house: str
    trials: tuple[SearchTrial, ...]
    skipped: str = ""


def base_policy(name: str) -> str:
    """The policy without the way in which it goes on when all is searched."""
    return name.removesuffix(START_OVER)


def policies_named(names: Sequence[str], *, looks_miss: bool = False) -> tuple[str, ...]:
    """The policies of an experiment: the named ones or all, with greedy first, the oracle last and
    those for looks that miss before it.

    Args:
        looks_miss: whether looks can miss; "all" then holds the policies for that, and conditioned-lios@start-over.

    Raises:
        UnknownName: a policy does not exist.
        BadValue: POLICY@start-over where no look misses.
    """
    every = policy_names(looks_miss=looks_miss)
    if looks_miss:
        every = (*every, f"conditioned-lios{START_OVER}")
    elif any(name.endswith(START_OVER) for name in names):
        raise BadValue("--policies", ", ".join(names), f"without {START_OVER}, unless looks can miss (--miss-rate)")
    wanted = every if "all" in [n.lower() for n in names] else tuple(names)
    chosen = [_checked(name) for name in wanted if name.lower() not in (GREEDY, ORACLE)]
    chosen.sort(key=lambda name: name in WHERE_LOOKS_MISS)
    return (GREEDY, *dict.fromkeys(chosen), ORACLE)


def run_experiment(
    experiment: Experiment,
    houses: Iterable[House],
    *,
    asked: Mapping[str, tuple[ItemType, ...]] | None = None,
    workers: int = 1,
    scheduler: str = "",
    kept: StoredResults[HouseResult] | None = None,
) -> Iterator[HouseResult]:
    """Every policy on every query of every house, in the houses' order.

    Args:
        asked: item types by house; None for all. Houses without an entry are left out.
        workers: number of processes; 1 runs in this process.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.
        kept: results of the same evaluation, stopped before, to which those of other houses are added.

    Raises:
        BadValue: fewer than one worker.
    """
    if workers < 1:
        raise BadValue("workers", workers, "at least 1")
    chosen = ((house, None if asked is None else asked.get(house.plan.name, ())) for house in houses)
    jobs = ((experiment, h.plan, dict(h.contents), items) for h, items in chosen if items is None or items)
    run = partial(run_in_order, _house_of, workers=workers, scheduler=scheduler)
    yield from run(jobs) if kept is None else run_resumable(jobs, kept, key=_key_of, run=run)


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
    base = base_policy(name)
    policy(base, origin=NameOrigin.USER)
    return (canonical_policy(base) or base) + name[len(base) :]


def _key_of(job: _Job) -> str:
    """All that the trials of a house depend on."""
    experiment, plan, contents, items = job
    asked = [(name, experiment.estimator_for(name, plan.name)) for name in experiment.policies]
    policies = [(name, content_of(name), believer, content_of(believer)) for name, believer in asked]
    return key_of(policies, experiment.costs, experiment.miss_rate, experiment.seed, plan, contents, items)


def _house_of(job: _Job) -> HouseResult:
    return _house(*job)


def _house(
    experiment: Experiment, plan: FloorPlan, contents: Contents, items: tuple[ItemType, ...] | None
) -> HouseResult:
    try:
        travel = navigate(plan).travel
        house = House(plan=plan, contents=contents)
        if experiment.miss_rate:
            trials = _trials_with_misses(experiment, house, travel, items)
        else:
            trials = house_trials(
                house,
                travel,
                policies=experiment.policies,
                estimators=lambda name: _estimator(experiment.estimator_for(name, plan.name)),
                costs=experiment.costs,
                item_types=items,
            )
    except ESTIMATOR_FAULTS:
        raise
    except LiosError as error:
        return HouseResult(house=plan.name, trials=(), skipped=str(error))
    return HouseResult(house=plan.name, trials=tuple(trials))


def _trials_with_misses(
    experiment: Experiment, house: House, travel: TravelCosts, items: tuple[ItemType, ...] | None
) -> list[SearchTrial]:
    trials: list[SearchTrial] = []
    for name in experiment.policies:
        base = base_policy(name)
        searcher = oracle_policy(house) if name == ORACLE else policy(base, origin=NameOrigin.USER)
        asked = None if base in ASKS_NO_BELIEF else _estimator(experiment.estimator_for(name, house.plan.name))
        for item in queries(house, travel) if items is None else items:
            misses = experiment.misses_of(name, house.plan.name, item)
            trials.append(
                search_with_misses(house, travel, item, searcher, asked, costs=experiment.costs, misses=misses)
            )
    return trials


def _estimator(name: str) -> Estimator:
    from workbench.beliefs.estimators import estimator

    return estimator(name, origin=NameOrigin.USER)
