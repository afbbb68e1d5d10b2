"""The runs of a folder, one row for each, from the logs' indexes or from an evaluation's own table.

The folder of `lios evaluate tasks` or `lios evaluate search` holds the cost of every trial; its logs, where they were
recorded, are in logs/ below it. No run is read.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from dashboards.model.replay_bounds import stored_bounds
from dashboards.panels.folder.runs import RunRow
from workbench.errors import LiosError, MalformedFile, NotFound
from workbench.evaluation.tasks.rows import SETTINGS_FILE, TRIALS_FILE, read_rows
from workbench.planning.tasks import Task, goal_types
from workbench.worlds.names import readable_name

SEARCH_TRIALS, SEARCH_TABLE = "trials.csv", "search.json"
SEARCH_COLUMNS = ("house", "item_type", "policy", "cost", "searches")
NO_LOG = -1
"""Index of a trial that was not recorded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvaluatedTrial:
    """One row of an evaluation, and the path of its log if it was recorded."""

    log: Path
    place: str
    scenario: str
    strategy: str
    seed: int
    outcome: str
    cost: float
    searches: int
    estimator: str = ""


class NotRecorded(NotFound):
    """An evaluation without logs."""

    def __init__(self, folder: Path) -> None:
        super().__init__(
            f"{folder}: an evaluation without logs. Record them: lios evaluate ... --record --force."
            f" Its table and figures need no logs: lios report {folder}"
        )


def evaluation_in(folder: Path) -> list[EvaluatedTrial] | None:
    """The trials of an evaluation's folder; None for another folder.

    Raises:
        MalformedFile: its table cannot be read.
    """
    if (folder / TRIALS_FILE).is_file() and (folder / SETTINGS_FILE).is_file():
        return _tasks(folder)
    if (folder / SEARCH_TRIALS).is_file() and (folder / SEARCH_TABLE).is_file():
        return _searches(folder)
    return None


def trial_rows(trials: Sequence[EvaluatedTrial], logs: Sequence[Path]) -> list[RunRow]:
    """Rows of trials; those without a log can be compared, not opened."""
    index = {path.resolve(): i for i, path in enumerate(logs)}
    return [
        RunRow(
            index=index.get(t.log.resolve(), NO_LOG),
            file=t.log.name,
            place=t.place,
            scenario=t.scenario,
            strategy=t.strategy,
            seed=t.seed,
            source="simulation",
            outcome=t.outcome,
            cost=t.cost,
            searches=t.searches,
            estimator=t.estimator,
        )
        for t in trials
    ]


def log_rows(logs: Sequence[Path], *, folder: Path | None) -> tuple[list[RunRow], list[str]]:
    """Rows of logs by their indexes, and the reasons why others have none.

    Args:
        folder: the folder whose listing is cached between calls.
    """
    from replayers.log_tools.listing import cache_path, rows_of

    memory = cache_path(folder) if folder is not None else None
    rows: list[RunRow] = []
    problems: list[str] = []
    for index, row in enumerate(rows_of(logs, memory=memory)):
        if row.problem and not row.run_id:
            named = row.problem if row.file in row.problem else f"{row.file}: {row.problem}"
            problems.append(named)
            continue
        rows.append(
            RunRow(
                index=index,
                file=_file_name(logs[index], folder),
                place=row.place,
                scenario=_sought(logs[index]) if row.scenario == "find" else row.scenario,
                strategy=row.strategy,
                seed=row.seed or 0,
                source=row.source,
                outcome=(row.status or "cut off") + (", not whole" if row.problem else ""),
                cost=row.cost,
                searches=row.searches,
                estimator=row.estimator,
                bounds=_bounds(logs[index]) if row.source == "replay" and row.cost is None else None,
                replay_of=_replayed(logs[index]) if row.source == "replay" else "",
            )
        )
    return rows, problems


def _bounds(replay: Path) -> tuple[float, float] | None:
    """The bounds of a replay's cost that are stored beside it, where both are proven."""
    kept = stored_bounds(replay)
    return (kept.lower, kept.upper) if kept and kept.lower is not None and kept.upper is not None else None


def _replayed(replay: Path) -> str:
    """The name of the log that a kept replay is of."""
    from replayers.batch.store import log_replayed

    log = log_replayed(replay)
    return log.name if log is not None else ""


def _file_name(log: Path, folder: Path | None) -> str:
    """A log's name, with the folders between it and the one that was opened."""
    return log.relative_to(folder).as_posix() if folder is not None and log.is_relative_to(folder) else log.name


def scenario_of(task: Task) -> str:
    """A scenario by name; a search by the item that it seeks."""
    if task.scenario == "find":
        return "find " + ", ".join(readable_name(t) for t in goal_types(task.goal))
    return task.scenario


def _sought(log: Path) -> str:
    from replayers.mcap_io.reader import attachment
    from workbench.log_schema.place import TASK_ATTACHMENT, task_from_json

    try:
        stored = attachment(log, TASK_ATTACHMENT)
        return scenario_of(task_from_json(stored)) if stored is not None else "find"
    except LiosError:
        return "find"


def _tasks(folder: Path) -> list[EvaluatedTrial]:
    from recorders.task_trials import log_path

    return [
        EvaluatedTrial(
            log=log_path(folder / "logs", row.scenario, row.trial, row.strategy),
            place=row.house,
            scenario=row.scenario,
            strategy=row.strategy,
            seed=row.seed,
            outcome=row.status,
            cost=row.cost,
            searches=row.searches,
            estimator=row.estimator,
        )
        for row in read_rows(folder / TRIALS_FILE, torn_is_fine=True)
    ]


def _searches(folder: Path) -> list[EvaluatedTrial]:
    from recorders.search_trials import log_path
    from workbench.evaluation.search.trials import SearchTrial
    from workbench.worlds.house import ItemType

    path = folder / SEARCH_TRIALS
    made: list[EvaluatedTrial] = []
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            for row in csv.DictReader(stream):
                house, item, policy, cost, searches = (row[name] for name in SEARCH_COLUMNS)
                if not isfinite(float(cost)):
                    raise ValueError(f"cost {cost}")
                trial = SearchTrial(house=house, item_type=ItemType(item), policy=policy, cost=float(cost), order=())
                made.append(
                    EvaluatedTrial(
                        log=log_path(folder / "logs", trial),
                        place=house,
                        scenario=f"find {readable_name(item)}",
                        strategy=policy,
                        seed=0,
                        outcome="done",
                        cost=trial.cost,
                        searches=int(searches),
                    )
                )
    except (KeyError, ValueError, TypeError, UnicodeDecodeError, csv.Error) as error:
        raise MalformedFile(path, f"no table of searches ({error})", "Give another folder") from error
    return made
