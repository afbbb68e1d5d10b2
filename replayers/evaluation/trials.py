"""Measures replay against hidden truth: runs are recorded, their truth is hidden, and every other strategy is
replayed.

One counterfactual is one log and one strategy other than the one that drove it. What it truly costs is found by
running it in the simulator; the replayer reads the log file alone. Measured: whether the truth is within the bounds,
how many are exact or narrow, and how often the estimate's interval covers the truth.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory

from recorders.simulated_run import RequestedTask, Trial, record_trial, trial_events, trial_for
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.evaluation.calibration import PitInterval, pit_interval, share_within
from replayers.runs.run import Run, read
from workbench.arrays import Floats
from workbench.errors import BadValue, LiosError, Unsupported
from workbench.evaluation.cluster import run_in_order
from workbench.evaluation.failed_estimator import require_beliefs
from workbench.evaluation.splits import split_indices
from workbench.execution.events import RunStatus
from workbench.execution.loop import outcome_of
from workbench.execution.start import scenario_start
from workbench.planning.actions import relevant_types
from workbench.plugins import NameOrigin
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import House
from workbench.worlds.procthor.load import load_house, load_houses
from workbench.worlds.shipped import shipped_houses

MAX_HOUSES_TRIED = 20
"""Houses tried in turn for each task, at most, since not every house supports every scenario."""

NARROW = 0.1
"""Within 10 %: (upper - lower) / lower."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayTask:
    """One task to run: a house, a scenario, a seed."""

    house: str
    scenario: str
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasurementSettings:
    """The settings of a measurement.

    Attributes:
        strategies: each records a log of every task, and is replayed over the logs of the others.
        estimator: the estimator whose beliefs the runs use.
        miss_rate: the chance that a look of the recorded run misses an item. Replays are given the number of items
            that were overlooked; the truth is a run that overlooks nothing, as a replayed strategy does.
        sees_m: how far all robots see open furniture in passing, in metres; 0 for not at all.
        trusting: the recording robot believes its looks, and never looks again.
    """

    tasks: tuple[ReplayTask, ...]
    strategies: tuple[str, ...]
    settings: ReplaySettings
    estimator: str = "counts"
    miss_rate: float = 0.0
    sees_m: float = 0.0
    trusting: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Counterfactual:
    """One measured replay; an infinite upper is none.

    Attributes:
        misses: how many items that matter to the task the recorded looks overlooked.
    """

    estimator: str
    house: str
    scenario: str
    seed: int
    recorded: str
    strategy: str
    true_cost: float
    true_status: str
    status: str
    lower: float
    upper: float
    lower_proof: str
    upper_proof: str
    complete: bool
    estimate: float | None
    interval: tuple[float, float] | None
    pit: PitInterval | None
    mass: float | None
    lower_if_beliefs_stand: float
    upper_if_beliefs_stand: float
    open: int
    stretches: int
    misses: int = 0

    @property
    def inside(self) -> bool:
        return self.lower - NEAR_COST <= self.true_cost <= self.upper + NEAR_COST

    @property
    def inside_if_beliefs_stand(self) -> bool:
        return self.lower_if_beliefs_stand - NEAR_COST <= self.true_cost <= self.upper_if_beliefs_stand + NEAR_COST

    @property
    def exact_if_beliefs_stand(self) -> bool:
        return self.upper_if_beliefs_stand - self.lower_if_beliefs_stand <= NEAR_COST

    @property
    def exact(self) -> bool:
        return self.upper - self.lower <= NEAR_COST

    @property
    def narrow(self) -> bool:
        return self.exact or (self.lower > 0 and (self.upper - self.lower) / self.lower <= NARROW)

    @property
    def within(self) -> float | None:
        """The share of the truth's PIT interval in the central 90 % of the sampled costs."""
        return None if self.pit is None else share_within(self.pit)

    @property
    def covered(self) -> bool | None:
        if self.interval is None:
            return None
        return self.interval[0] - NEAR_COST <= self.true_cost <= self.interval[1] + NEAR_COST


@dataclass(frozen=True, slots=True, kw_only=True)
class SkippedTask:
    """A task that could not be set in a house, or a replay whose strategy broke.

    Attributes:
        fault: the replayer's own: a run just recorded that it does not reproduce.
    """

    task: ReplayTask
    reason: str
    fault: bool = False


def tasks_for(
    houses: Path | None, part: str, scenarios: Sequence[str], *, count: int, per_task: int, seed: int
) -> tuple[ReplayTask, ...]:
    """Enough tasks for `count` counterfactuals: houses in turn, scenarios in turn, then the next seed.

    Raises:
        BadValue: no scenarios, or fewer than two strategies.
        FileMissing, Malformed, UnknownName: the houses cannot be read.
    """
    if not scenarios or per_task < 1:
        raise BadValue(
            "scenarios and strategies", (list(scenarios), per_task), "a scenario and two strategies or more"
        )
    path = houses or shipped_houses()
    loaded = load_houses(path)
    indices = split_indices(path, part, houses=len(loaded))
    tasks: list[ReplayTask] = []
    wanted = -(-count // per_task)
    for k in range(MAX_HOUSES_TRIED * wanted):
        turn, index = divmod(k, len(indices))
        scenario = scenarios[(len(tasks) + turn) % len(scenarios)]
        task = ReplayTask(house=f"{path}:{indices[index]}", scenario=scenario, seed=seed + turn)
        if _supports(loaded[indices[index]], task):
            tasks.append(task)
        if len(tasks) == wanted:
            break
    if not tasks:
        raise BadValue("scenarios", ", ".join(scenarios), f"some that a house of {path} ({part}) can support")
    return tuple(tasks)


def _supports(house: House, task: ReplayTask) -> bool:
    """Whether a house holds what a scenario needs."""
    try:
        scenario_start(task.scenario, house, seed=task.seed)
    except Unsupported:
        return False
    return True


def counterfactuals(
    plan: MeasurementSettings, *, workers: int = 1, scheduler: str = ""
) -> Iterator[Counterfactual | SkippedTask]:
    """Measures task by task, in order, for any number of workers; a unit of work is one recorded log.

    Args:
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.
    """
    shared = replace(plan, tasks=())  # a unit carries its own task alone
    units = ((task, shared, name) for task in plan.tasks for name in plan.strategies)
    logs = run_in_order(_log_of_unit, units, workers=workers, scheduler=scheduler)
    tasks, of_task = iter(plan.tasks), list[MeasuredLog | SkippedTask]()
    for log in logs:
        of_task.append(log)
        if len(of_task) == len(plan.strategies):
            yield from _with_truths(next(tasks), of_task)
            of_task = []


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredLog:
    """One recorded log of a task: what its own strategy truly costs, and the others' replays, not yet judged.

    Attributes:
        replays: with the costs in their drawn worlds, or why there is no replay.
    """

    strategy: str
    true_cost: float
    true_status: str
    replays: tuple[tuple[Counterfactual, Floats | None] | SkippedTask, ...]


def measure_log(task: ReplayTask, plan: MeasurementSettings, strategy: str) -> MeasuredLog | SkippedTask:
    """Records one strategy's log of a task and replays every other strategy over it.

    What the others truly cost is found where their own logs are recorded: each run is simulated once.
    """
    try:
        trial = trial_of(task, plan, strategy)
        truth = outcome_of(list(trial_events(trial)))
    except LiosError as error:
        return SkippedTask(task=task, reason=str(error))
    require_beliefs(truth)
    with TemporaryDirectory(prefix="lios-replay-") as folder:
        log = Path(folder) / f"{trial.strategy}.mcap"
        record_trial(replace(trial, miss_rate=plan.miss_rate, trusts_looks=plan.trusting), log)
        misses = overlooked_items(read(log, with_truth=True)) if plan.miss_rate else 0
        settings = _with_misses(plan.settings, misses) if plan.miss_rate else plan.settings
        prepared = prepare_log(read(log), settings)
        others = [name for name in plan.strategies if name != trial.strategy]
        replays = tuple(_replayed(prepared, other, (task, plan), trial=trial, misses=misses) for other in others)
    return MeasuredLog(
        strategy=str(trial.strategy), true_cost=truth.cost, true_status=truth.status.value, replays=replays
    )


def _replayed(
    prepared: PreparedLog, other: str, asked: tuple[ReplayTask, MeasurementSettings], *, trial: Trial, misses: int
) -> tuple[Counterfactual, Floats | None] | SkippedTask:
    """One replay, whose truth is not known yet, and its costs in the drawn worlds."""
    task, plan = asked
    made = replay_on(prepared, other, origin=NameOrigin.USER)
    if made.bounds is None:
        reason = f"{other} over a log of {trial.strategy}: {made.reason}"
        return SkippedTask(task=task, reason=reason, fault=made.status is RunStatus.NOT_REPRODUCED)
    standing = made.if_beliefs_stand or made.bounds
    found = Counterfactual(
        estimator=plan.estimator,
        house=task.house,
        scenario=task.scenario,
        seed=task.seed,
        recorded=str(trial.strategy),
        strategy=other,
        true_cost=nan,
        true_status="",
        status=made.status.value,
        lower=made.bounds.lower,
        upper=made.bounds.upper,
        lower_proof=made.bounds.lower_proof.value,
        upper_proof=made.bounds.upper_proof.value,
        complete=made.bounds.complete,
        estimate=made.estimate.mean if made.estimate else None,
        interval=made.estimate.interval90 if made.estimate else None,
        pit=None,
        mass=made.estimate.interval90_mass if made.estimate else None,
        lower_if_beliefs_stand=standing.lower,
        upper_if_beliefs_stand=standing.upper,
        open=len(prepared.evidence.open),
        stretches=made.segments,
        misses=misses,
    )
    return found, made.drawn


def _with_truths(
    task: ReplayTask, logs: Sequence[MeasuredLog | SkippedTask]
) -> Iterator[Counterfactual | SkippedTask]:
    """The counterfactuals of one task's logs, judged by what each strategy truly costs."""
    measured = [log for log in logs if isinstance(log, MeasuredLog)]
    if len(measured) < len(logs):
        yield next(log for log in logs if isinstance(log, SkippedTask))
        return
    truth = {log.strategy: log for log in measured}
    for one in chain.from_iterable(log.replays for log in measured):
        if isinstance(one, SkippedTask):
            yield one
            continue
        found, drawn = one
        true = truth[found.strategy]
        pit = None if drawn is None else pit_interval(drawn, true.true_cost)
        yield replace(found, true_cost=true.true_cost, true_status=true.true_status, pit=pit)


def overlooked_items(run: Run) -> int:
    """How many items of types that matter to the task stood where the run looked, and were never seen.

    Raises:
        ValueError: the run was read without its truth.
    """
    if run.truth is None:
        raise ValueError("the run was read without its truth")
    looked = {o.container for o in run.observations if not o.known_at_start}
    seen = {item.id for o in run.observations for item in o.items}
    types = frozenset(relevant_types(run.task.goal))
    there = (item for c in sorted(looked) for item in run.truth.contents.get(c, ()))
    return sum(item.type in types and item.id not in seen for item in there)


def _with_misses(settings: ReplaySettings, misses: int) -> ReplaySettings:
    """The settings with so many misses allowed for."""
    return replace(settings, assumptions=replace(settings.assumptions, misses=misses))


def outside_bounds(found: Iterable[Counterfactual]) -> tuple[Counterfactual, ...]:
    """Counterfactuals whose true cost is outside the bounds: each is a fault."""
    return tuple(c for c in found if not c.inside)


def trial_of(task: ReplayTask, plan: MeasurementSettings, strategy: str) -> Trial:
    """The trial of one task by one strategy."""
    trial = trial_for(
        RequestedTask(scenario=task.scenario),
        load_house(task.house),
        strategy=strategy,
        estimator=plan.estimator,
        seed=task.seed,
    )
    return replace(trial, sees_m=plan.sees_m)


def _log_of_unit(unit: tuple[ReplayTask, MeasurementSettings, str]) -> MeasuredLog | SkippedTask:
    return measure_log(*unit)
