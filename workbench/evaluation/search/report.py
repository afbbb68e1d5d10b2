"""The object-search evaluation: from houses to a table, trials and figures (`lios evaluate search`)."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from workbench.beliefs.estimators import estimator
from workbench.errors import BadValue, Failed, OutputExists
from workbench.evaluation.beliefs.fold_weights import FoldEstimators, Folds, FoldSplit, make_folds, require_trainable
from workbench.evaluation.search.calibration import look_calibration
from workbench.evaluation.search.experiment import (
    Experiment,
    HouseResult,
    draw_queries,
    policies_named,
    run_experiment,
)
from workbench.evaluation.search.table import Costs, costs_of, pairs, rows, rows_by_kind
from workbench.evaluation.search.trials import SearchTrial
from workbench.evaluation.splits import effective_split, is_shared, split_indices, split_of
from workbench.evaluation.statistics import intervals_in_words
from workbench.evaluation.stored_results import StoredResults
from workbench.files import atomic, write_atomically
from workbench.plugins import NameOrigin
from workbench.search.costs import ActionCosts
from workbench.worlds.house import House, ItemType
from workbench.worlds.perception import missing_at
from workbench.worlds.procthor.assets import assets_for
from workbench.worlds.procthor.load import iter_houses
from workbench.worlds.shipped import shipped_houses

MAX_SHARED_HOUSES = 100_000
KEPT_FILE = "houses.jsonl"
"""Results of an evaluation that is not complete, a house a line."""

Progress = Callable[[Iterable[HouseResult]], Iterable[HouseResult]]


class NoTrials(Failed):
    """There were no queries to run."""

    def __init__(self, path: Path, part: str, reason: str) -> None:
        super().__init__(f"{path} ({part}) gives no query: {reason}. Give other houses or another --split.")


@dataclass(frozen=True, kw_only=True)
class SearchRequest:
    """The settings of a search evaluation.

    Attributes:
        houses: the file; None for the shipped ones.
        policies: names, or ("all",).
        queries: "all", or how many to draw.
        part: part of a shared file (evaluation/splits.py); ignored with folds.
        scheduler: a Dask scheduler's address, or "local" for a Dask cluster of `workers` here.
        folds: cross-validation over the training houses, each evaluated with weights trained without it.
        miss_rate: the chance that a look misses an item.

    Raises:
        BadValue: `queries` is neither, or a miss rate outside [0, 1). An unknown part raises UnknownName.
    """

    houses: Path | None = None
    policies: tuple[str, ...] = ("all",)
    queries: str = "all"
    part: str = "test"
    estimator: str = "best"
    paper_estimator: str = "fcnn"
    search_cost: float = 0.0
    workers: int = 1
    scheduler: str = ""
    seed: int = 0
    assets: Path | None = None
    folds: Folds | None = None
    miss_rate: float = 0.0

    def __post_init__(self) -> None:
        split_of(self.part)
        missing_at(self.miss_rate)
        if self.queries != "all" and not (
            self.queries.isascii() and self.queries.isdigit() and int(self.queries) > 0
        ):
            raise BadValue("--queries", self.queries, "all, or a whole number from 1")
        if self.seed < 0:
            raise BadValue("--seed", self.seed, "at least 0")

    @property
    def file(self) -> Path:
        return self.houses or shipped_houses()

    @property
    def sizes(self) -> Path | None:
        """The asset table that is used: the given one, else the one beside the houses."""
        return assets_for(self.file, self.assets)

    @property
    def split(self) -> str:
        """A description of the evaluated houses."""
        return effective_split(self.file, self.part) if self.folds is None else self.folds.split

    @cached_property
    def fold_split(self) -> FoldSplit | None:
        """The houses in folds; None without folds. Raises InputError as make_folds."""
        return None if self.folds is None else make_folds(self.file, self.folds, assets=self.assets, seed=self.seed)

    def experiment(self) -> Experiment:
        """The policies and estimators.

        Raises:
            UnknownName: a policy or an estimator does not exist.
            InputError: weights cannot be read.
        """
        experiment = Experiment(
            policies=policies_named(self.policies, looks_miss=self.miss_rate > 0),
            estimator=self.estimator,
            paper_estimator=self.paper_estimator,
            costs=ActionCosts(search=self.search_cost),
            miss_rate=self.miss_rate,
            seed=self.seed,
        )
        if self.folds is not None:
            require_trainable(experiment.estimators())
            return experiment
        for name in (self.estimator, self.paper_estimator):
            estimator(name, origin=NameOrigin.USER)
        return experiment

    def chosen_houses(self) -> Iterator[House]:
        """Yield the houses of the part, or all houses of the folds."""
        if self.fold_split is not None:
            yield from self.fold_split.own.houses
            return
        wanted = None
        if is_shared(self.file):
            wanted = frozenset(split_indices(self.file, self.part, houses=MAX_SHARED_HOUSES))
        for index, house in enumerate(iter_houses(self.file, assets=self.sizes)):
            if wanted is None or index in wanted:
                yield house

    def asked(self) -> dict[str, tuple[ItemType, ...]] | None:
        """The sampled queries; None for all."""
        if self.queries == "all":
            return None
        return draw_queries(self.chosen_houses(), int(self.queries), rng=np.random.default_rng(self.seed))


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchReport:
    """The results."""

    request: SearchRequest
    experiment: Experiment
    trials: tuple[SearchTrial, ...]
    skipped: tuple[tuple[str, str], ...]
    seconds: float

    @property
    def costs(self) -> Costs:
        return costs_of(self.trials)


def measure(
    request: SearchRequest,
    *,
    fold_estimators: FoldEstimators | None = None,
    progress: Progress = iter,
    kept: StoredResults[HouseResult] | None = None,
) -> SearchReport:
    """Run every trial.

    Args:
        fold_estimators: the estimators of each house's fold, for a request with folds.
        progress: wraps the results as they come, for a progress bar.
        kept: results of the same evaluation, stopped before.

    Raises:
        NoTrials: there is no query.
        InputError: a file, policy or estimator cannot be used.
    """
    experiment = replace(request.experiment(), fold_estimators=fold_estimators or FoldEstimators())
    began = time.perf_counter()
    results = list(
        progress(
            run_experiment(
                experiment,
                request.chosen_houses(),
                asked=request.asked(),
                workers=request.workers,
                scheduler=request.scheduler,
                kept=kept,
            )
        )
    )
    trials = tuple(trial for result in results for trial in result.trials)
    skipped = tuple((result.house, result.skipped) for result in results if result.skipped)
    if not trials:
        reason = skipped[0][1] if skipped else "no house there holds an item that can be reached"
        raise NoTrials(request.file, request.split, reason.rstrip("."))
    return SearchReport(
        request=request,
        experiment=experiment,
        trials=trials,
        skipped=skipped,
        seconds=time.perf_counter() - began,
    )


def answer_of(report: SearchReport) -> dict[str, Any]:
    """The results as plain values for JSON."""
    costs, seed = report.costs, report.request.seed
    return {
        "rows": rows(costs, seed=seed),
        "by_kind": rows_by_kind(costs, seed=seed),
        "pairs": pairs(costs, seed=seed),
        "looks": look_calibration(report.trials),
        "houses": len(set(costs.houses)),
        "queries": len(costs.houses),
        "file": str(report.request.file),
        "split": report.request.split,
        "also": [str(path) for path in report.request.folds.also] if report.request.folds else [],
        "assets": None if report.request.sizes is None else str(report.request.sizes),
        "estimator": report.experiment.estimator,
        "paper_estimator": report.experiment.paper_estimator,
        "search_cost": report.experiment.costs.search,
        "miss_rate": report.experiment.miss_rate,
        "seed": seed,
        "workers": report.request.workers,
        "seconds": report.seconds,
        "skipped": [{"house": house, "reason": reason} for house, reason in report.skipped],
    }


def output_folder(path: Path, *, force: bool) -> Path:
    """The output folder, created if needed.

    Raises:
        OutputExists: it holds a report already, and force is not given.
        BadValue: it is a file.
    """
    if path.exists() and not path.is_dir():
        raise BadValue("-o/--output", path, "a folder")
    if (path / "search.json").exists() and not force:
        raise OutputExists(path / "search.json")
    path.mkdir(parents=True, exist_ok=True)
    return path


def kept_houses(folder: Path, *, force: bool) -> StoredResults[HouseResult]:
    """The results that a stopped evaluation left in its folder; with force, none.

    Raises:
        EvaluationInProgress: another process writes there.
    """
    path = folder / KEPT_FILE
    if force:
        path.unlink(missing_ok=True)
    return StoredResults(path, HouseResult)


def write_report(report: SearchReport, answer: dict[str, Any], folder: Path) -> list[Path]:
    """Write the results as JSON and as a Markdown table, and every trial as CSV."""
    as_json, table, trials = folder / "search.json", folder / "search.md", folder / "trials.csv"
    write_atomically(as_json, msgspec.json.format(msgspec.json.encode(answer), indent=2) + b"\n")
    write_atomically(table, as_markdown(answer).encode())
    with atomic(trials) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ["house", "item_type", "kind", "policy", "cost", "searches", "predicted", "corrected", "order"]
        )
        for t in report.trials:
            shown = ["" if v is None else f"{v:.6f}" for v in (t.predicted, t.corrected)]
            writer.writerow(
                [t.house, t.item_type, t.kind, t.policy, f"{t.cost:.6f}", len(t.order), *shown, " ".join(t.order)]
            )
    return [as_json, table, trials]


def as_markdown(answer: dict[str, Any]) -> str:
    """The rows as a Markdown table, all items first and then each kind."""
    head = (
        "| items | policy | cost | 95 % | saved of Greedy | Greedy costs more | gap closed | 95 % "
        "| worse than Greedy | looks | ms a decision | realised / predicted | realised / corrected |"
    )
    lines = [head, "|" + " --- |" * 13]
    for row in [{"kind": "all", **r} for r in answer["rows"]] + answer["by_kind"]:
        lines.append(
            f"| {row['kind']} | {row['policy']} | {row['mean_cost']:.2f} | {_span(row['ci95'], 2)} "
            f"| {_share(row['saved_of_greedy'])} | {_share(row['greedy_costs_more'])} "
            f"| {_share(row['oracle_gap_closed'])} | {_span(row['oracle_gap_closed_ci95'], 3)} "
            f"| {_share(row['worse_than_greedy'])} | {row['searches']:.2f} | {row['ms_a_decision']:.2f} "
            f"| {_ratio(row['realised_over_predicted'])} | {_ratio(row['realised_over_corrected'])} |"
        )
    drew = intervals_in_words(row["ci95_resamples"] for row in [*answer["rows"], *answer["by_kind"]])
    return "\n".join(lines) + (f"\n\n{drew}\n" if drew else "\n")


def _span(ends: list[float | None], digits: int) -> str:
    return " to ".join("-" if end is None else f"{end:.{digits}f}" for end in ends)


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
