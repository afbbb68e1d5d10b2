"""`lios evaluate tasks`: the paper's results table, with intervals, on this machine or on a Dask cluster."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from workbench.options import (
    MOST,
    AlsoLearnt,
    AssetsOrBeside,
    DryRun,
    FoldCount,
    Houses,
    Json,
    MissRate,
    MoveRatesFile,
    RecordTrials,
    Scheduler,
    Sees,
    Split,
    Workers,
)
from workbench.parameters import Option

if TYPE_CHECKING:
    from workbench.evaluation.beliefs.fold_weights import FoldSplit
    from workbench.evaluation.tasks.cell_filter import CellFilter
    from workbench.evaluation.tasks.experiment import PlannedTrials, TaskRequest
    from workbench.evaluation.tasks.rows import TaskRow
    from workbench.evaluation.tasks.store import TrialStore


def tasks(
    houses: Houses = None,
    scenarios: Annotated[
        str, Option("--scenarios", help="all (the paper's five), or names: deliver-N, any-of-N, FILE.yaml, ...")
    ] = "all",
    strategies: Annotated[
        str, Option("--strategies", "-s", help="all, paper, or names; module:Class and NAME@SOLVER too.")
    ] = "all",
    cells: Annotated[
        str,
        Option("-k", help='Only these cells, as pytest -k: "deliver and not greedy", "coffee or breakfast".'),
    ] = "",
    trials: Annotated[int, Option("--trials", "-n", min=1, max=MOST, help="Trials of each scenario.")] = 100,
    miss_rate: MissRate = 0.0,
    sees: Sees = 0.0,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    split: Split = "test",
    folds: FoldCount = None,
    also: AlsoLearnt = None,
    estimator: Annotated[str, Option("--estimator", help="Estimator of our strategies and plug-ins.")] = "best",
    paper_estimator: Annotated[
        str, Option("--paper-estimator", help="Estimator of the paper's five strategies.")
    ] = "fcnn",
    seed: Annotated[int, Option("--seed", help="Seed of houses, tasks, starts and the bootstrap.")] = 0,
    assets: AssetsOrBeside = None,
    memory: Annotated[
        bool, Option("--memory", help="Measure instead what memory of five earlier tasks in each house saves.")
    ] = False,
    rates: MoveRatesFile = None,
    record: RecordTrials = False,
    output: Annotated[
        Path | None, Option("--output", "-o", help="A folder for the trials and the table; resumable.")
    ] = None,
    dry_run: DryRun = False,
    force: Annotated[bool, Option("--force", help="Start over in a folder that holds trials.")] = False,
    json: Json = False,
) -> None:
    """Measure strategies on tasks: the paper's table of five scenarios.

    All strategies, the oracle among them, run the same trials. To resume a stopped evaluation, give the same
    command again; costs do not depend on the number of workers. With --miss-rate, looks miss items, with the same
    draws for every strategy, and strategies continue until what must exist is found; the oracle's looks never miss.
    With --sees, every robot sees open furniture in passing.

    Examples:

        lios evaluate tasks --workers 2 -o out

        lios evaluate tasks --scenarios deliver-3,coffee --strategies paper,conditioned-lios --trials 20 -o out

        lios evaluate tasks --memory --scenarios deliver-3 --strategies conditioned-lios --trials 60

        lios evaluate tasks -k "deliver and (model or conditioned)" --dry-run

        lios evaluate tasks --scheduler tcp://10.0.0.1:8786 --record -o out

        lios evaluate tasks --houses mine.jsonl.gz --folds 5 --scenarios deliver-3 --workers 2 -o out

        lios evaluate tasks --miss-rate 0.2 --scenarios deliver-3 --strategies robust-lios,conditioned-lios -o out
    """
    from workbench.errors import BadValue
    from workbench.evaluation.beliefs.fold_weights import folds_from_options
    from workbench.evaluation.tasks import experiment
    from workbench.evaluation.tasks.cell_filter import cell_filter
    from workbench.evaluation.tasks.store import TrialStore
    from workbench.evaluation.tasks.table import answer_of
    from workbench.terminal import emit_json
    from workbench.worlds.perception import missing_at
    from workbench.worlds.procthor.assets import assets_for
    from workbench.worlds.shipped import shipped_houses
    from workbench.worlds.sight.lines_of_sight import checked_radius

    missing_at(miss_rate)
    if record and output is None:
        raise BadValue("-o/--output", None, "a folder, for --record to record to")
    table = assets_for(houses or shipped_houses(), assets)
    dealt_as = folds_from_options(folds, also)
    request = experiment.TaskRequest(
        houses=str((houses or shipped_houses()).absolute()),
        split=split if dealt_as is None else "train",
        scenarios=experiment.scenario_list(scenarios),
        strategies=experiment.strategy_list(strategies),
        trials=trials,
        seed=seed,
        estimator=estimator,
        paper_estimator=paper_estimator,
        assets=str(table.absolute()) if table else "",
        folds=dealt_as.count if dealt_as else 0,
        also=tuple(str(path.absolute()) for path in dealt_as.also) if dealt_as else (),
        miss_rate=miss_rate,
        sees_m=checked_radius(sees),
    )
    meant = cell_filter(cells)
    chosen = [(s, n) for s in request.scenarios for n in request.strategies if meant(s, n)]
    if not chosen:
        raise BadValue("-k", cells, "an expression that selects a cell; --dry-run without -k lists the cells")
    request.require_estimators()
    if memory or rates is not None:
        from recorders.commands.evaluate.memory_tables import show_tasks

        alone = not (record or cells or dealt_as or dry_run or scheduler or miss_rate or sees or workers > 1)
        if not memory:
            raise BadValue("--memory", None, "given with --rates")
        if not alone:
            others = "without --record, --folds, --workers, --scheduler, --dry-run, --miss-rate, --sees and -k"
            raise BadValue("--memory", memory, f"given {others}")
        show_tasks(request, rates, output, force=force, json=json)
        return
    fold_split = request.fold_split()
    planned = experiment.plan_trials(request, fold_split)
    _say_refused(planned)
    if dry_run:
        _show_cells(chosen, planned, json=json)
        return
    if not planned.keys:
        raise experiment.NoSupportingHouse(request)
    how = _TrialOptions(meant, fold_split, output, workers, scheduler, record)
    with TrialStore(output, request, force=force) if output else nullcontext() as store:
        rows = _run(request, planned, store, how)
    answer = answer_of(request, planned, experiment.wanted_rows(request, planned.keys, rows, meant))
    if output:
        _write(answer, output)
    emit_json(answer) if json else _show(answer, output)


class _TrialOptions(NamedTuple):
    """How the trials are run."""

    meant: CellFilter
    fold_split: FoldSplit | None
    output: Path | None
    workers: int
    scheduler: str
    record: bool


def _run(request: TaskRequest, planned: PlannedTrials, store: TrialStore | None, how: _TrialOptions) -> list[TaskRow]:
    """Run the missing trials; returns all rows."""
    from recorders.task_trials import TrialRecorder
    from workbench.evaluation.beliefs.fold_training import trained_per_fold
    from workbench.evaluation.cluster import Workforce
    from workbench.evaluation.tasks import experiment
    from workbench.evaluation.tasks.workers import run_units
    from workbench.terminal import progress, say

    done = list(store.rows) if store else []
    event_hook = TrialRecorder(folder=how.output / "logs") if how.record and how.output else None
    if event_hook:
        done = [row for row in done if event_hook.log_of(row).exists()]
    with trained_per_fold(
        request.estimators(),
        how.fold_split,
        how.output,
        progress=lambda trained, total: progress(trained, title="Training", total=total),
        on=Workforce(how.workers, how.scheduler),
    ) as fold_estimators:
        units = experiment.remaining_units(request, planned.keys, done, event_hook, how.meant, fold_estimators)
        if done:
            say(f"{len(done)} runs are done already; {sum(len(u.strategies) for u in units)} are left.")
        results = run_units(units, workers=how.workers, scheduler=how.scheduler)
        for rows in progress(results, title="Running", total=len(units)):
            done += rows
            if store:
                store.add(rows)
    return done


def _show_cells(chosen: list[tuple[str, str]], planned: PlannedTrials, *, json: bool) -> None:
    from workbench.terminal import emit_json, emit_table, say

    counted = [
        {"scenario": s, "strategy": n, "trials": sum(k.scenario == s for k in planned.keys)} for s, n in chosen
    ]
    if json:
        emit_json({"cells": counted})
        return
    emit_table(counted)
    say(f"{sum(int(str(cell['trials'])) for cell in counted)} runs")


def _write(answer: dict[str, Any], folder: Path) -> None:
    import msgspec

    from workbench.evaluation.tasks.table import markdown
    from workbench.files import write_atomically

    write_atomically(folder / "table.json", msgspec.json.format(msgspec.json.encode(answer), indent=2) + b"\n")
    from workbench.evaluation.statistics import intervals_in_words

    words = intervals_in_words(row["ci95_resamples"] for row in answer["rows"])
    write_atomically(folder / "table.md", (markdown(answer["rows"]) + f"\n{words}.\n").encode())


def _say_refused(planned: PlannedTrials) -> None:
    from workbench.terminal import say

    for scenario, fine in planned.houses.items():
        refused = [(house, lacks) for s, house, lacks in planned.refused if s == scenario]
        if not refused:
            continue
        say(f"{scenario}: {fine} houses support it, {len(refused)} do not:")
        for house, lacks in refused:
            say(f"  {house}: {lacks}")


SHOWN = ("scenario", "strategy", "trials", "success_rate", "mean_cost", "against_model_lios", "searches")
TIMES = ("replan_p50_s", "replan_p95_s")


def _show(answer: dict[str, Any], output: Path | None) -> None:
    from workbench.evaluation.statistics import ends_in_words, intervals_in_words
    from workbench.terminal import counted, emit_table, say, signed_percentage

    shown = [row | {"against_model_lios": signed_percentage(row["against_model_lios"])} for row in answer["rows"]]
    emit_table(shown, columns=(*SHOWN, *TIMES))
    for pair in answer["pairs"]:
        if pair["b"] != "model-lios" or pair["a"] in ("conditioned-lios", "robust-lios"):
            share = ends_in_words(pair["share_ci95"], "+.1f", scale=100)
            say(
                f"{pair['scenario']}: {pair['a']} against {pair['b']}: {100 * pair['share']:+.1f} % "
                f"[{share.replace(' to ', ', ')}]"
            )
    if words := intervals_in_words(row["ci95_resamples"] for row in answer["rows"]):
        say(words)
    for row in answer["rows"]:
        if row["reasons"]:
            why, times = next(iter(row["reasons"].items()))
            failed = counted(sum(row["reasons"].values()), "run")
            say(f"{row['scenario']}: {row['strategy']} failed in {failed}, {times} for this reason: {why}")
    if output:
        say(f"Written to {output}. Next: lios report {quote(str(output))}")
