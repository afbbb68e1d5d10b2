"""Recording of task trials while they are evaluated, to OUTPUT/logs/SCENARIO/TRIAL-STRATEGY.mcap."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from recorders.run_identity import Driver, run_id, run_info
from recorders.run_recorder import RunRecorder
from workbench.beliefs.belief import Estimator
from workbench.evaluation.tasks.names import scenario_file_name
from workbench.evaluation.tasks.rows import TaskRow
from workbench.evaluation.tasks.trials import PreparedTrial
from workbench.execution.events import Event
from workbench.files import file_name_of
from workbench.log_schema.events import RunInfo
from workbench.log_schema.perception_json import perception_to_settings
from workbench.log_schema.place import Place
from workbench.log_schema.sight_json import sight_to_settings
from workbench.worlds.perception import missing_at


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRecorder:
    """An event hook that records events. It is pickled for workers, so it holds only a folder and no open file."""

    folder: Path

    def log_of(self, row: TaskRow) -> Path:
        """The log file of a row's trial."""
        return log_path(self.folder, row.scenario, row.trial, row.strategy)

    def __call__(
        self, trial: PreparedTrial, strategy: str, estimator: Estimator, events: Iterator[Event]
    ) -> Iterator[Event]:
        path = log_path(self.folder, trial.key.scenario, trial.key.trial, strategy)
        path.parent.mkdir(parents=True, exist_ok=True)
        first = next(events)
        with RunRecorder(
            path,
            info=_info(trial, strategy, estimator, first),
            place=Place.of(trial.house.plan, trial.navigation),
            task=trial.task,
            costs=trial.costs,
            truth=trial.house.contents,
            force=True,
            settings={
                **perception_to_settings(missing_at(trial.misses_of(strategy))),
                **sight_to_settings(trial.sees_m),
            },
        ) as recorder:
            recorder.record(first)
            yield first
            for event in events:
                recorder.record(event)
                yield event


def log_path(folder: Path, scenario: str, trial: int, strategy: str) -> Path:
    """The log file of a trial, unique for every scenario and strategy."""
    return folder / scenario_file_name(scenario) / f"{trial:04d}-{file_name_of(strategy)}.mcap"


def _info(trial: PreparedTrial, strategy: str, estimator: Estimator, first: Event) -> RunInfo:
    key, place = trial.key, trial.house.plan.name
    rate = trial.misses_of(strategy)
    missing = f"/miss rate {rate!r}" if rate else ""
    seeing = f"/sees {trial.sees_m!r}" if trial.sees_m else ""
    return run_info(
        trial.task,
        Driver(strategy=strategy, estimator=estimator.name, seed=key.seed),
        id=run_id(f"{place}/{key.scenario}/{key.trial}/{key.seed}/{strategy}/{estimator.name}{missing}{seeing}"),
        place=place,
        started_ns=first.stamp_ns,
    )
