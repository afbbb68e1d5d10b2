"""`lios evaluate search`: the paper's object-search experiment, policy by policy, with intervals over houses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import (
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
    Split,
    Workers,
)
from workbench.parameters import Option

if TYPE_CHECKING:
    from workbench.evaluation.search.report import SearchReport


def search(
    houses: Houses = None,
    policies: Annotated[
        str, Option("--policies", "-p", help="all, or names separated by commas; module:function for your own.")
    ] = "all",
    queries: Annotated[
        str, Option("--queries", help="all pairs of house and item type, or the number to draw.")
    ] = "all",
    part: Split = "test",
    folds: FoldCount = None,
    also: AlsoLearnt = None,
    estimator: Annotated[str, Option("--estimator", help="Estimator of the policies.")] = "best",
    paper_estimator: Annotated[
        str, Option("--paper-estimator", help="Estimator of the paper's policy, lios.")
    ] = "fcnn",
    look: Annotated[float, Option("--search-cost", help="Cost of a look: 0 in simulation, 1 on the robot.")] = 0.0,
    miss_rate: MissRate = 0.0,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    seed: Annotated[int, Option("--seed", help="Seed of drawn queries and of the bootstrap.")] = 0,
    sees: Annotated[
        str,
        Option("--sees", help="Measure instead what seeing in passing saves, from so many metres: 2.5, or 1,2.5,4."),
    ] = "",
    memory: Annotated[
        bool,
        Option("--memory", help="Measure instead what memory of five earlier searches in each house saves."),
    ] = False,
    rates: MoveRatesFile = None,
    assets: AssetsOrBeside = None,
    output: Annotated[
        Path | None, Option("--output", "-o", help="A folder for the table, the trials and the figures.")
    ] = None,
    record: RecordTrials = False,
    figures: Annotated[bool, Option("--figures/--no-figures", help="Draw figures into OUTPUT.")] = True,
    dry_run: DryRun = False,
    force: Annotated[bool, Option("--force", help="Replace files in the output folder.")] = False,
    json: Json = False,
) -> None:
    """Measure search policies: the paper's object-search experiment.

    With -o, results are stored house by house, and the same command resumes a stopped evaluation.

    Every pair of a house and an item type that it holds is one query: find it and bring it to the start. Greedy and
    the oracle are always among the policies. Where looks can miss (--miss-rate), every policy continues until it
    has found the item, using the posterior once everything is searched; POLICY@start-over instead forgets what it
    has seen. The oracle's looks never miss.

    Examples:

        lios evaluate search --workers 2

        lios evaluate search --houses houses.jsonl.gz --policies lios,conditioned-lios --queries 200 -o out

        lios evaluate search --queries 20 --record -o out

        lios evaluate search --houses houses.jsonl.gz --sees 1,2.5,4 --policies conditioned-lios

        lios evaluate search --houses houses.jsonl.gz --memory --policies conditioned-lios

        lios evaluate search --houses mine.jsonl.gz --folds 5 --workers 2 -o out

        lios evaluate search --miss-rate 0.2 --policies robust-lios,conditioned-lios,conditioned-lios@start-over
    """
    from contextlib import nullcontext

    from workbench.errors import BadValue
    from workbench.evaluation.beliefs.fold_training import trained_per_fold
    from workbench.evaluation.beliefs.fold_weights import folds_from_options
    from workbench.evaluation.cluster import Workforce
    from workbench.evaluation.search.report import SearchRequest, answer_of, kept_houses, measure, output_folder
    from workbench.terminal import counted, emit_json, progress, say

    if record and output is None:
        raise BadValue("-o/--output", None, "a folder, for --record to record to")
    request = SearchRequest(
        houses=houses,
        policies=tuple(name.strip() for name in policies.split(",") if name.strip()),
        queries=queries,
        part=part,
        estimator=estimator,
        paper_estimator=paper_estimator,
        search_cost=look,
        workers=workers,
        scheduler=scheduler,
        seed=seed,
        assets=assets,
        folds=folds_from_options(folds, also),
        miss_rate=miss_rate,
    )
    if sees:
        from recorders.commands.evaluate.sight_table import show_sight

        if memory or record or request.folds is not None or dry_run or workers > 1 or scheduler:
            given = "given without --memory, --record, --folds, --workers, --scheduler and --dry-run"
            raise BadValue("--sees", sees, given)
        show_sight(request, sees, output, force=force, json=json)
        return
    if memory or rates is not None:
        from recorders.commands.evaluate.memory_tables import show_searches

        if not memory:
            raise BadValue("--memory", None, "given with --rates")
        if record or request.folds is not None or dry_run or miss_rate or workers > 1:
            others = "without --record, --folds, --miss-rate, --workers and --dry-run"
            raise BadValue("--memory", memory, f"given {others}")
        show_searches(request, rates, output, force=force, json=json)
        return
    experiment = request.experiment()
    if dry_run:
        count = sum(1 for _ in request.chosen_houses())
        planned = {"houses": count, "queries": queries, "policies": list(experiment.policies), "seed": seed}
        planned_text = f"{queries} queries in {count} houses, policies {', '.join(experiment.policies)}, seed {seed}"
        emit_json(planned) if json else say(planned_text)
        return
    folder = None if output is None else output_folder(output, force=force)
    with (
        trained_per_fold(
            experiment.estimators(),
            request.fold_split,
            folder,
            progress=lambda them, total: progress(them, title="Training", total=total),
            on=Workforce(workers, scheduler),
        ) as fold_estimators,
        nullcontext() if folder is None else kept_houses(folder, force=force) as kept,
    ):
        if kept:
            say(f"Resuming: {counted(len(kept), 'result')} in {kept.path}.")
        report = measure(
            request,
            fold_estimators=fold_estimators,
            progress=lambda results: progress(results, title="Searching"),
            kept=kept,
        )
        answer = answer_of(report)
        if folder is not None:
            _write(report, answer, folder, figures=figures)
            if record:
                answer["logs"] = _record(report, folder / "logs", force=force)
        if kept is not None:
            kept.discard()
    emit_json(answer) if json else _show(answer, output)


def _write(report: SearchReport, answer: dict[str, Any], folder: Path, *, figures: bool) -> None:
    from workbench.evaluation.search.report import write_report

    write_report(report, answer, folder)
    if figures:
        from workbench.evaluation.figures.search_figures import draw_all

        draw_all(report, folder / "figures")


def _record(report: SearchReport, folder: Path, *, force: bool) -> int:
    """Record the trials; returns the number of logs."""
    from recorders.search_trials import record_search_trials
    from workbench.terminal import progress

    houses = report.request.chosen_houses()
    logs = record_search_trials(report.trials, houses, report.experiment, folder, force=force)
    return sum(1 for _ in progress(logs, title="Recording", total=len(report.trials)))


SHOWN = (
    "policy",
    "mean_cost",
    "saved_of_greedy",
    "oracle_gap_closed",
    "worse_than_greedy",
    "searches",
    "ms_a_decision",
)

MISSED = ("policy", "mean_cost", "found", "saved_of_greedy", "searches")
"""What is shown where looks can miss."""

SHARES = ("saved_of_greedy", "oracle_gap_closed")
"""Columns whose values are shares of another cost: shown as signed percentages, as "against model lios" is."""

PARTS = ("found", "worse_than_greedy")
"""Columns whose values are shares of the queries."""


def _show(answer: dict[str, Any], output: Path | None) -> None:
    from workbench.evaluation.statistics import ends_in_words, intervals_in_words
    from workbench.terminal import emit_table, percentage, say, signed_percentage

    title = f"{answer['queries']} queries in {answer['houses']} houses ({answer['split']})"
    shown = [
        row
        | {name: signed_percentage(row[name]) for name in SHARES}
        | {name: percentage(row[name]) for name in PARTS}
        for row in answer["rows"]
    ]
    emit_table(shown, columns=MISSED if answer["miss_rate"] else SHOWN, title=title)
    if answer["miss_rate"]:
        _say_what_robust_saves(answer)
    for pair in answer["pairs"]:
        if pair["a"] == "lios" and pair["b"] != "oracle":
            saved = [None if end is None else -end for end in reversed(pair["ci95"])]
            say(
                f"{pair['b']} saves {-pair['b_minus_a']:z.2f} against lios "
                f"(95 %: {ends_in_words(saved, 'z.2f')}; "
                f"{-100 * pair['share_of_greedy']:z.1f} points of Greedy's cost)"
            )
    if words := intervals_in_words(row["ci95_resamples"] for row in answer["rows"]):
        say(words)
    for skipped in answer["skipped"]:
        say(f"left out: {skipped['house']}: {skipped['reason']}")
    say(f"{answer['seconds']:.0f} s, seed {answer['seed']}" + (f". Written to {output}" if output else ""))


def _say_what_robust_saves(answer: dict[str, Any]) -> None:
    """The mean cost of robust-lios against that of each other policy."""
    from workbench.evaluation.statistics import ends_in_words
    from workbench.terminal import say

    for pair in answer["pairs"]:
        if pair["b"] == "robust-lios":
            share = ends_in_words(pair["share_of_a_ci95"], "+.1f", scale=100)
            say(f"robust-lios against {pair['a']}: {100 * pair['share_of_a']:+.1f} % (95 %: {share})")
