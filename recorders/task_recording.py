"""How are task trials recorded while they are evaluated? Each to OUTPUT/logs/SCENARIO/TRIAL-STRATEGY.mcap."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from recorders.provenance import revision
from recorders.recorder import RunRecorder
from workbench import __version__
from workbench.beliefs.belief import Estimator
from workbench.evaluation.task_trials import Staged
from workbench.execution.events import Event
from workbench.planning.scenarios import is_scenario_file
from workbench.runs.place import Place
from workbench.runs.vocabulary import SCHEMA_VERSION, RunInfo, Stamp


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordTo:
    """A tap that writes what goes by. It travels to workers, so it holds a folder and nothing open."""

    folder: Path

    def __call__(
        self, staged: Staged, strategy: str, estimator: Estimator, events: Iterator[Event]
    ) -> Iterator[Event]:
        path = log_path(self.folder, staged.key.scenario, staged.key.trial, strategy)
        path.parent.mkdir(parents=True, exist_ok=True)
        first = next(events)
        with RunRecorder(
            path,
            info=_info(staged, strategy, estimator, first),
            place=Place.of(staged.house.plan, staged.navigation),
            task=staged.task,
            costs=staged.costs,
            truth=staged.house.contents,
            force=True,
        ) as recorder:
            recorder.record(first)
            yield first
            for event in events:
                recorder.record(event)
                yield event


LONGEST_NAME = 100


def log_path(folder: Path, scenario: str, trial: int, strategy: str) -> Path:
    """Where a trial's log stands. Different scenarios and strategies have different logs, whatever they are called."""
    return folder / _plain(scenario) / f"{trial:04d}-{_plain(strategy)}.mcap"


def _plain(name: str) -> str:
    """The name as a file's; where it must be changed, with a hash of the whole, so that no two are the same."""
    last = Path(name).name if is_scenario_file(name) else name
    plain = re.sub(r"[^A-Za-z0-9+._@-]+", "-", last).strip("-.")[:LONGEST_NAME]
    return name if plain == name else f"{plain}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _info(staged: Staged, strategy: str, estimator: Estimator, first: Event) -> RunInfo:
    code = revision()
    key = staged.key
    identity = f"{staged.house.plan.name}/{key.scenario}/{key.trial}/{key.seed}/{strategy}/{estimator.name}"
    return RunInfo(
        run_id=hashlib.sha256(identity.encode()).hexdigest()[:12],
        schema_version=SCHEMA_VERSION,
        place=staged.house.plan.name,
        scenario=staged.task.scenario,
        strategy=strategy,
        estimator=estimator.name,
        seed=key.seed,
        started=Stamp.of(first.stamp_ns),
        title=staged.task.title,
        code_version=__version__,
        code_revision=code.commit,
        code_dirty=code.dirty,
        weights_sha256=estimator.name.partition("@")[2],
    )
