"""Recording of the object-search experiment: every trial run again in the closed loop, one MCAP file each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from recorders.simulated_run import Trial, record_trial
from workbench.errors import Failed
from workbench.evaluation.search.experiment import Experiment
from workbench.evaluation.search.missed_looks import START_OVER
from workbench.evaluation.search.strategies import strategy_of, with_policy
from workbench.evaluation.search.trials import SearchTrial
from workbench.execution.events import RunStatus
from workbench.files import file_name_of, plain_file_name
from workbench.planning.tasks import find_task
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import START, House


class RecordingDiffers(Failed):
    """The cost of the closed loop differs from that of the trial."""

    def __init__(self, path: Path, recorded: float, measured: float) -> None:
        super().__init__(
            f"{path}: the recorded run cost {recorded:.3f}, the trial {measured:.3f}. "
            "The policy or the estimator gives different answers to the same question."
        )


def record_search_trials(
    trials: Iterable[SearchTrial], houses: Iterable[House], experiment: Experiment, folder: Path, *, force: bool
) -> Iterator[Path]:
    """Record the trials, house by house; yields the log files. Searches that start over are left out.

    Raises:
        OutputExists: a log exists and `force` is false.
        RecordingDiffers: a run's cost differs from that of its trial.
    """
    by_house: dict[str, list[SearchTrial]] = {}
    for trial in trials:
        if trial.policy.endswith(START_OVER):  # no strategy: the closed loop goes on by posterior
            continue
        by_house.setdefault(trial.house, []).append(trial)
    for house in houses:
        for trial in by_house.get(house.plan.name, ()):
            yield _record(trial, house, experiment, folder, force=force)


def log_path(folder: Path, trial: SearchTrial) -> Path:
    """FOLDER/<house>/<item type>.<policy>.mcap, with names that any file system takes."""
    return (
        folder / plain_file_name(trial.house) / f"{file_name_of(trial.item_type)}.{file_name_of(trial.policy)}.mcap"
    )


def _record(trial: SearchTrial, house: House, experiment: Experiment, folder: Path, *, force: bool) -> Path:
    path = log_path(folder, trial)
    path.parent.mkdir(parents=True, exist_ok=True)
    named = strategy_of(trial.policy)
    misses = experiment.misses_of(trial.policy, trial.house, trial.item_type)
    task = find_task(trial.item_type, START)
    run = Trial(
        house=house,
        task=replace(task, available=(trial.item_type,)) if experiment.miss_rate else task,
        strategy=with_policy(trial.policy) if named is None else named,
        estimator=experiment.estimator_for(trial.policy, trial.house),
        costs=experiment.costs,
        seed=misses.seed if experiment.miss_rate else 0,
        miss_rate=misses.rate,
    )
    end = record_trial(run, path, force=force)
    if end.status is not RunStatus.DONE or abs(end.cost - trial.cost) > NEAR_COST:
        raise RecordingDiffers(path, end.cost, trial.cost)
    return path
