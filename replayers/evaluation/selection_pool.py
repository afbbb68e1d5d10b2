"""The pool of trials for the selection experiment: every strategy driven in every house, and the others replayed.

A selector's run drives one strategy a trial, and sees of the others what their replays show. Which one it drives does
not change what driving any of them would have shown, so each trial is computed once for all selectors and seeds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np

from recorders.simulated_run import record_trial
from replayers.batch.store import to_stored
from replayers.counterfactual.prepared_log import PreparedLog, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.evaluation.trials import MeasurementSettings, ReplayTask, SkippedTask, trial_of
from replayers.runs.run import read
from replayers.selection.prior_costs import prior_drawn
from replayers.selection.trial_costs import PriorCosts, TrialCosts, trial_costs
from workbench.errors import LiosError, MalformedFile
from workbench.evaluation.cluster import run_in_order
from workbench.evaluation.failed_estimator import ESTIMATOR_FAULTS, require_beliefs
from workbench.execution.events import RunStatus
from workbench.files import write_atomically
from workbench.plugins import NameOrigin


@dataclass(frozen=True, slots=True, kw_only=True)
class PoolTrial:
    """One task, driven by each strategy in turn.

    Attributes:
        house, scenario, seed: which task.
        true: what each strategy costs there, in the order of the strategies.
        seen: what the log of each strategy shows about all of them.
        broke: why each strategy broke when it was driven ("" where it did not); empty if none did.
    """

    house: str
    scenario: str
    seed: int
    true: tuple[float, ...]
    seen: tuple[TrialCosts, ...]
    broke: tuple[str, ...] = ()


def pool_trials(
    plan: MeasurementSettings, *, workers: int = 1, scheduler: str = ""
) -> Iterator[PoolTrial | SkippedTask]:
    """Computes the trials of a pool, in order, for any number of workers.

    Args:
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.
    """
    shared = replace(plan, tasks=())  # a unit carries its own task alone
    tasks = ((task, shared) for task in plan.tasks)
    return run_in_order(_pool_trial, tasks, workers=workers, scheduler=scheduler)


def pool_trial(task: ReplayTask, plan: MeasurementSettings) -> PoolTrial | SkippedTask:
    """One task driven by every strategy, each log replayed by all.

    Raises:
        RunWithoutBeliefs: the estimator failed.
    """
    try:
        trials = [trial_of(task, plan, name) for name in plan.strategies]
        with TemporaryDirectory(prefix="lios-select-") as folder:
            logs = [Path(folder) / f"{number}.mcap" for number in range(len(trials))]
            ends = [record_trial(trial, log) for trial, log in zip(trials, logs, strict=True)]
            for end in ends:
                require_beliefs(end)
            seen: list[TrialCosts] = []
            prior: PriorCosts | None = None
            for log in logs:
                run = read(log)
                prepared = prepare_log(run, plan.settings, with_paths=False)
                if not seen:  # all begin alike
                    prior = _prior(prepared, plan.strategies)
                replays = [
                    to_stored(prepared, replay_on(prepared, name, origin=NameOrigin.USER), key="")
                    for name in plan.strategies
                ]
                costs = trial_costs(replays, plan.strategies, limit=run.task.failure_cost)
                seen.append(replace(costs, prior=prior))
    except ESTIMATOR_FAULTS:
        raise
    except LiosError as error:
        return SkippedTask(task=task, reason=str(error))
    broke = tuple(end.reason if end.status is RunStatus.PLANNER_FAILED else "" for end in ends)
    return PoolTrial(
        house=task.house,
        scenario=task.scenario,
        seed=task.seed,
        true=tuple(end.cost for end in ends),
        seen=tuple(seen),
        broke=broke if any(broke) else (),
    )


def _prior(prepared: PreparedLog, strategies: Sequence[str]) -> PriorCosts | None:
    drawn = prior_drawn(prepared, strategies)
    if not drawn or set(drawn) != set(strategies):
        return None
    common = min(len(costs) for costs in drawn.values())
    return PriorCosts.of(np.array([drawn[name][:common] for name in strategies]))


class _StoredTrial(msgspec.Struct, frozen=True, kw_only=True):
    """A trial of a pool as one line of JSON; None stands for what is infinite or not known. The prior is empty where
    there is none."""

    house: str
    scenario: str
    seed: int
    strategies: tuple[str, ...]
    limit: float
    true: tuple[float, ...]
    lower: tuple[tuple[float, ...], ...]
    upper: tuple[tuple[float | None, ...], ...]
    estimate: tuple[tuple[float | None, ...], ...]
    max_difference: tuple[tuple[tuple[float | None, ...], ...], ...] = msgspec.field(name="most_apart")
    prior: tuple[float, ...]
    prior_variance: float
    broke: tuple[str, ...] = ()


def write_pool(path: Path, trials: Sequence[PoolTrial]) -> None:
    """Writes a pool, one trial a line; whoever is interrupted keeps the trials from before."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, msgspec.json.Encoder().encode_lines([_stored(trial) for trial in trials]))


def read_pool(path: Path) -> tuple[PoolTrial, ...]:
    """Reads a pool.

    Raises:
        MalformedFile: a file that is no pool, or one without trials.
    """
    try:
        stored = msgspec.json.Decoder(_StoredTrial).decode_lines(path.read_bytes())
        trials = tuple(_trial(line) for line in stored)
    except (msgspec.MsgspecError, ValueError) as error:
        raise MalformedFile(
            path, f"this is not a pool of trials ({error})", "Make it again: lios evaluate select --force"
        ) from None
    if not trials:
        raise MalformedFile(path, "a pool without trials", "Make it again: lios evaluate select --force")
    return trials


def _stored(trial: PoolTrial) -> _StoredTrial:
    return _StoredTrial(
        house=trial.house,
        scenario=trial.scenario,
        seed=trial.seed,
        strategies=trial.seen[0].strategies,
        limit=trial.seen[0].limit,
        true=trial.true,
        lower=tuple(tuple(s.lower.tolist()) for s in trial.seen),
        upper=tuple(_finite(s.upper) for s in trial.seen),
        estimate=tuple(_finite(s.estimate) for s in trial.seen),
        max_difference=tuple(tuple(_finite(row) for row in s.max_difference) for s in trial.seen),
        prior=tuple(trial.seen[0].prior.mean.tolist()) if trial.seen[0].prior else (),
        prior_variance=trial.seen[0].prior.variance if trial.seen[0].prior else 0.0,
        broke=trial.broke,
    )


def _trial(line: _StoredTrial) -> PoolTrial:
    names = line.strategies
    prior = PriorCosts(mean=np.array(line.prior), variance=line.prior_variance) if line.prior else None
    seen = [
        TrialCosts(
            log=f"{line.house} seed {line.seed}",
            strategies=names,
            driven=name,
            lower=np.array(line.lower[i], dtype=np.float64),
            upper=_array(line.upper[i], inf),
            estimate=_array(line.estimate[i], np.nan),
            max_difference=np.array([_array(row, inf) for row in line.max_difference[i]]),
            limit=line.limit,
            prior=prior,
        )
        for i, name in enumerate(names)
    ]
    return PoolTrial(
        house=line.house,
        scenario=line.scenario,
        seed=line.seed,
        true=line.true,
        seen=tuple(seen),
        broke=line.broke,
    )


def _finite(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> tuple[float | None, ...]:
    return tuple(float(v) if np.isfinite(v) else None for v in values)


def _array(values: Sequence[float | None], absent: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array([absent if v is None else v for v in values], dtype=np.float64)


def _pool_trial(task: tuple[ReplayTask, MeasurementSettings]) -> PoolTrial | SkippedTask:
    return pool_trial(*task)
