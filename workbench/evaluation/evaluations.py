"""`evaluate`: beliefs, search policies or strategies measured from Python, with data frames of the results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import msgspec

from workbench.errors import BadValue
from workbench.evaluation.beliefs.fold_training import trained_per_fold
from workbench.evaluation.beliefs.report import BeliefRequest
from workbench.evaluation.beliefs.report import measure as measure_beliefs
from workbench.evaluation.cluster import Workforce
from workbench.evaluation.search.report import SearchRequest
from workbench.evaluation.search.report import answer_of as search_answer
from workbench.evaluation.search.report import measure as measure_searches
from workbench.evaluation.tasks.experiment import (
    NoSupportingHouse,
    TaskRequest,
    plan_trials,
    remaining_units,
    scenario_list,
    strategy_list,
    wanted_rows,
)
from workbench.evaluation.tasks.table import answer_of as task_answer
from workbench.evaluation.tasks.workers import run_units
from workbench.worlds.shipped import shipped_houses

if TYPE_CHECKING:
    import pandas as pd

Request = SearchRequest | BeliefRequest | TaskRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """The results of an evaluation.

    Attributes:
        answer: all of them as plain values: what the command prints with --json.
        trials: what was measured one by one: searches, tasks, or queries of beliefs.
    """

    answer: Mapping[str, Any]
    trials: tuple[Mapping[str, Any], ...]

    @property
    def frame(self) -> pd.DataFrame:
        """One row a policy, strategy and scenario, or estimator; columns as in --json."""
        return _frame(self.answer["rows"])

    @property
    def trial_frame(self) -> pd.DataFrame:
        """One row a trial."""
        return _frame(self.trials)


def evaluate(request: Request, *, workers: int = 1, scheduler: str = "") -> Evaluation:
    """Measure what a request names, as `lios evaluate belief`, `search` or `tasks` does. Nothing is written.

    Args:
        request: a BeliefRequest, SearchRequest or TaskRequest.
        workers: number of processes; results do not depend on it. Beliefs are measured in this one.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.

    Raises:
        InputError: a file, policy, strategy, estimator, scenario or scheduler cannot be used.
        Unsupported: there is nothing to measure.
    """
    if isinstance(request, SearchRequest):
        return _searches(replace(request, workers=workers, scheduler=scheduler))
    if isinstance(request, TaskRequest):
        return _tasks(_as_commanded(request), Workforce(workers, scheduler))
    if workers != 1 or scheduler:
        raise BadValue("workers", scheduler or workers, "1 for beliefs, which are measured in this process")
    report = measure_beliefs(request)
    queries = ({"estimator": name, **asdict(query)} for name, judged in report.judged.items() for query in judged)
    return Evaluation(answer=report.answer, trials=tuple(queries))


def _searches(request: SearchRequest) -> Evaluation:
    experiment = request.experiment()
    on = Workforce(request.workers, request.scheduler)
    with trained_per_fold(experiment.estimators(), request.fold_split, None, on=on) as fold_estimators:
        report = measure_searches(request, fold_estimators=fold_estimators)
    return Evaluation(answer=search_answer(report), trials=tuple(asdict(trial) for trial in report.trials))


def _as_commanded(request: TaskRequest) -> TaskRequest:
    """The request with the names that the command would make of its own: "all", aliases, and the oracle."""
    return msgspec.structs.replace(
        request,
        houses=request.houses or str(shipped_houses()),
        scenarios=scenario_list(",".join(request.scenarios)),
        strategies=strategy_list(",".join(request.strategies)),
    )


def _tasks(request: TaskRequest, on: Workforce) -> Evaluation:
    request.require_estimators()
    fold_split = request.fold_split()
    planned = plan_trials(request, fold_split)
    if not planned.keys:
        raise NoSupportingHouse(request)
    with trained_per_fold(request.estimators(), fold_split, None, on=on) as fold_estimators:
        units = remaining_units(request, planned.keys, (), None, fold_estimators=fold_estimators)
        made = _flat(run_units(units, workers=on.workers, scheduler=on.scheduler))
        rows = wanted_rows(request, planned.keys, made)
    answer = task_answer(request, planned, rows)
    return Evaluation(answer=answer, trials=tuple(msgspec.structs.asdict(row) for row in rows))


def _flat(lists: Iterable[list[Any]]) -> Iterator[Any]:
    return (row for some in lists for row in some)


def _frame(rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    from workbench.third_party.data_frames import pd

    return pd.DataFrame([dict(row) for row in rows])
