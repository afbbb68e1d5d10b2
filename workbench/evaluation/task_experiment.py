"""How are many task trials run? In processes of this machine or on a Dask cluster, resumable, always the same rows.

Rows go to OUTPUT/trials.jsonl as they come, flushed one by one; a run that was killed goes on with what is missing.
The answer is made of the rows sorted by scenario, strategy and trial, so that it does not depend on who ran what.
"""

from __future__ import annotations

import os
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from workbench.errors import BadValue, InputError, MalformedFile, MissingExtra
from workbench.evaluation.cell_filter import CellFilter, cell_filter
from workbench.evaluation.fold_weights import Believers, Dealt, Folds, deal
from workbench.evaluation.splits import split_indices
from workbench.evaluation.task_rows import SETTINGS_FILE, TRIALS_FILE, TaskRow, read_rows
from workbench.evaluation.task_trials import (
    Tap,
    TrialKey,
    run_staged,
    stage,
    supported_houses,
    trial_keys,
)
from workbench.planning.scenarios import SCENARIOS, is_scenario_file, scenario_name
from workbench.planning.strategies import STRATEGIES, canonical_name, resolved_name
from workbench.process_pool import process_pool
from workbench.worlds.house_files import house_lines
from workbench.worlds.procthor import house_name

PAPER_STRATEGIES = ("opt-greedy", "pes-greedy", "opt-lios", "pes-lios", "model-lios")
RETRIES = 5
"""How often a Dask unit is tried again when its worker dies."""


class OtherEvaluation(InputError):
    """A folder holds the trials of another evaluation."""

    def __init__(self, folder: Path, field: str, theirs: object, ours: object) -> None:
        super().__init__(
            f"{folder} holds another evaluation: its {field} is {theirs!r}, not {ours!r}. "
            "Give another -o, or --force."
        )


class TaskRequest(msgspec.Struct, frozen=True, kw_only=True):
    """What is asked for; the same request gives the same rows.

    Attributes:
        scenarios, strategies: names, in the table's order.
        estimator: what ours and plug-ins believe; paper_estimator: what the paper's five believe.
        folds: 0, or the houses to learn from are met in as many folds, each by estimators trained without it.
        also: files of houses that are learnt from only, with folds.
    """

    houses: str
    split: str
    scenarios: tuple[str, ...]
    strategies: tuple[str, ...]
    trials: int
    seed: int
    estimator: str
    paper_estimator: str
    assets: str = ""
    folds: int = 0
    also: tuple[str, ...] = ()

    def dealt(self) -> Dealt | None:
        """The houses in folds; None without folds. Raises InputError as deal does."""
        if not self.folds:
            return None
        folds = Folds(count=self.folds, also=tuple(Path(path) for path in self.also))
        assets = Path(self.assets) if self.assets else None
        return deal(Path(self.houses), folds, assets=assets, seed=self.seed)

    def estimators(self) -> tuple[str, ...]:
        """What the strategies believe, by name."""
        return tuple(dict.fromkeys(self.estimator_of(name) for name in self.strategies))

    def estimator_of(self, strategy: str) -> str:
        name = canonical_name(strategy.partition("@")[0])
        return self.paper_estimator if name in PAPER_STRATEGIES else self.estimator


@dataclass(frozen=True, slots=True, kw_only=True)
class Unit:
    """A trial and the strategies that are still to run it, each with its estimator."""

    key: TrialKey
    strategies: tuple[tuple[str, str], ...]
    assets: str = ""
    tap: Tap | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """All trials of a request, and the houses that could not support a scenario, with the reason."""

    keys: tuple[TrialKey, ...]
    refused: tuple[tuple[str, str, str], ...]
    """(scenario, house, what it lacks)."""
    houses: dict[str, int]
    """How many houses support each scenario."""


def scenario_list(names: str) -> tuple[str, ...]:
    """ "all" or names separated by commas, checked."""
    if names.strip().lower() == "all":
        return SCENARIOS
    listed = tuple(name.strip() for name in names.split(",") if name.strip())
    if not listed:
        raise BadValue("scenarios", names, "all, or names separated by commas")
    return tuple(dict.fromkeys(name if is_scenario_file(name) else scenario_name(name) for name in listed))


def strategy_list(names: str) -> tuple[str, ...]:
    """ "all", "paper" or names separated by commas; the oracle is always last among the built-in ones."""
    from workbench.planning.strategies import strategy as strategy_named

    if names.strip().lower() == "all":
        return tuple(STRATEGIES)
    listed = tuple(name.strip() for name in names.split(",") if name.strip())
    if not listed:
        raise BadValue("strategies", names, "all, paper, or names separated by commas")
    chosen: list[str] = []
    for name in listed:
        if name.lower() == "paper":
            chosen += PAPER_STRATEGIES
            continue
        resolved = resolved_name(name)
        if resolved.partition("@")[0] != "oracle":
            strategy_named(name)
        chosen.append(resolved)
    return tuple(dict.fromkeys((*chosen, "oracle")))


def plan_trials(request: TaskRequest, dealt: Dealt | None = None) -> Plan:
    """Which trials there are. Houses that cannot support a scenario are named, not skipped in silence.

    Args:
        dealt: the houses of a request with folds.
    """
    path = Path(request.houses)
    count = sum(1 for _ in house_lines(path))
    if dealt is None:
        indices = split_indices(path, request.split, houses=count)
    else:
        indices = tuple(k for k in range(count) if house_name(path, k) in dealt.fold_of())
    if not indices:
        raise BadValue("houses", f"{path} ({request.split})", "a file with houses in that split")
    keys: list[TrialKey] = []
    refused: list[tuple[str, str, str]] = []
    houses: dict[str, int] = {}
    assets = Path(request.assets) if request.assets else None
    for scenario in request.scenarios:
        fine, others = supported_houses(scenario, request.houses, indices, assets=assets, seed=request.seed)
        houses[scenario] = len(fine)
        refused += [(scenario, other.house, other.lacks) for other in others]
        keys += trial_keys(scenario, request.houses, fine, trials=request.trials, seed=request.seed)
    return Plan(keys=tuple(keys), refused=tuple(refused), houses=houses)


def run_unit(unit: Unit) -> list[TaskRow]:
    """One trial by several strategies; what workers run."""
    staged = stage(unit.key, assets=Path(unit.assets) if unit.assets else None)
    return [run_staged(staged, name, estimator=believer, tap=unit.tap) for name, believer in unit.strategies]


def units_left(
    request: TaskRequest,
    keys: Iterable[TrialKey],
    done: Iterable[TaskRow],
    tap: Tap | None,
    meant: CellFilter = cell_filter(""),
    believers: Believers | None = None,
) -> list[Unit]:
    """What is still to be run of the cells that are meant.

    Args:
        believers: weights by house, of a request with folds.
    """
    weights = believers or Believers()
    have = {(row.scenario, row.trial, row.strategy) for row in done}
    units: list[Unit] = []
    for key in keys:
        names = tuple(
            n for n in request.strategies if meant(key.scenario, n) and (key.scenario, key.trial, n) not in have
        )
        if names:
            house = house_name(Path(key.houses), key.house_index)
            pairs = tuple((name, weights.of(request.estimator_of(name), house)) for name in names)
            units.append(Unit(key=key, strategies=pairs, assets=request.assets, tap=tap))
    return units


def run_units(units: list[Unit], *, workers: int, scheduler: str = "") -> Iterator[list[TaskRow]]:
    """The rows of every unit, in the order in which they are done.

    Args:
        workers: processes of this machine; 1 runs here.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` on this machine.

    Raises:
        MissingExtra: a scheduler is given and dask.distributed is not installed.
        InputError: the scheduler does not answer.
    """
    if scheduler:
        yield from _on_dask(units, scheduler, workers)
    elif workers <= 1:
        yield from (run_unit(unit) for unit in units)
    else:
        yield from _in_processes(units, workers)


def _in_processes(units: list[Unit], workers: int) -> Iterator[list[TaskRow]]:
    with _one_thread_each(), process_pool(workers) as pool:
        for future in as_completed([pool.submit(run_unit, unit) for unit in units]):
            yield future.result()


def _on_dask(units: list[Unit], scheduler: str, workers: int) -> Iterator[list[TaskRow]]:
    try:
        import distributed
    except ImportError as error:
        raise MissingExtra("a Dask cluster", "cluster") from error
    with _one_thread_each(), _client(distributed, scheduler, workers) as client:
        futures = [client.submit(run_unit, unit, pure=False, retries=RETRIES) for unit in units]
        for future in distributed.as_completed(futures):
            yield future.result()


@contextmanager
def _client(distributed: Any, scheduler: str, workers: int) -> Generator[Any]:
    if scheduler == "local":
        with (
            distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = distributed.Client(scheduler, timeout="15s")
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"no Dask scheduler answers at {scheduler}: {error}. Start one: dask scheduler") from error
    with client:
        yield client


@contextmanager
def _one_thread_each() -> Generator[None]:
    """Workers use one thread each: many processes with many threads are slower than many processes."""
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update({name: os.environ.get(name, "1") for name in names})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


class TrialStore:
    """The folder of an evaluation: its settings and its rows so far.

    Raises:
        OtherEvaluation: the folder holds rows of another request.
        MalformedFile: its files are not what they should be.
    """

    def __init__(self, folder: Path, request: TaskRequest, *, force: bool = False) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        settings, trials = folder / SETTINGS_FILE, folder / TRIALS_FILE
        if force:
            trials.unlink(missing_ok=True)
        elif settings.exists() and trials.exists():
            _same_request(folder, read_request(settings), request)
        settings.write_bytes(msgspec.json.format(msgspec.json.encode(request), indent=2) + b"\n")
        self.rows = read_rows(trials, torn_is_fine=True) if trials.exists() else []
        whole = trials.with_name(f".{trials.name}.{os.getpid()}")  # a row torn by a crash goes; the others never do
        whole.write_bytes(b"".join(msgspec.json.encode(row) + b"\n" for row in self.rows))
        whole.replace(trials)
        self._stream = trials.open("ab")

    def add(self, rows: Iterable[TaskRow]) -> None:
        for row in rows:
            self.rows.append(row)
            self._stream.write(msgspec.json.encode(row) + b"\n")
        self._stream.flush()

    def close(self) -> None:
        self._stream.close()


def _same_request(folder: Path, theirs: TaskRequest, ours: TaskRequest) -> None:
    """More trials, scenarios or strategies of the same evaluation are welcome; all else must agree."""
    for field in ("houses", "split", "seed", "estimator", "paper_estimator", "assets", "folds", "also"):
        if getattr(theirs, field) != getattr(ours, field):
            raise OtherEvaluation(folder, field, getattr(theirs, field), getattr(ours, field))


def read_request(path: Path) -> TaskRequest:
    try:
        return msgspec.json.decode(path.read_bytes(), type=TaskRequest)
    except msgspec.MsgspecError as error:
        raise MalformedFile(path, f"no settings of an evaluation: {error}", "Give another folder") from error


def wanted_rows(
    request: TaskRequest, keys: Iterable[TrialKey], rows: Iterable[TaskRow], meant: CellFilter = cell_filter("")
) -> list[TaskRow]:
    """The rows of this request and of the cells that are meant, in an order that does not depend on who ran what."""
    order = {(key.scenario, key.trial): i for i, key in enumerate(keys)}
    names = {name: i for i, name in enumerate(request.strategies)}
    chosen = [
        r for r in rows if (r.scenario, r.trial) in order and r.strategy in names and meant(r.scenario, r.strategy)
    ]
    return sorted(chosen, key=lambda r: (order[r.scenario, r.trial], names[r.strategy]))
