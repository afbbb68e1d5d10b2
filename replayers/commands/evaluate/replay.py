"""`lios evaluate replay`: measures bounds and estimates of replay against a hidden truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import (
    MOST,
    BoundsBudget,
    DryRun,
    Force,
    Houses,
    Json,
    MissRate,
    Scheduler,
    Sees,
    Split,
    Workers,
)
from workbench.parameters import Option

if TYPE_CHECKING:
    from replayers.evaluation.trials import Counterfactual, MeasurementSettings, SkippedTask


def replay(
    houses: Houses = None,
    part: Split = "test",
    scenarios: Annotated[
        str, Option("--scenarios", help="Scenarios, separated by commas, taken in turn.")
    ] = "find,deliver-3,any-of-three",
    strategies: Annotated[
        str, Option("--strategies", "-s", help="Each records a log and is replayed over the others' logs.")
    ] = "all",
    count: Annotated[
        int,
        Option(
            "--counterfactuals",
            "-n",
            min=1,
            max=MOST,
            help="At least this many for each estimator; tasks are measured whole.",
        ),
    ] = 2000,
    estimators: Annotated[
        str,
        Option(
            "--estimator",
            "--estimators",
            help="Estimators of the runs, separated by commas; each measures the same tasks.",
        ),
    ] = "fcnn,counts,best",
    worlds: Annotated[int, Option("--worlds", min=0, max=MOST, help="Worlds sampled for each estimate.")] = 200,
    budget: BoundsBudget = None,
    miss_rate: MissRate = 0.0,
    trusting: Annotated[
        bool, Option("--trusting", help="With --miss-rate: the recording robot trusts its looks.")
    ] = False,
    sees: Sees = 0.0,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    seed: Annotated[int, Option("--seed", help="Seed of the tasks and of the sampled worlds.")] = 0,
    output: Annotated[Path | None, Option("--output", "-o", help="A CSV file with every counterfactual.")] = None,
    force: Force = False,
    dry_run: DryRun = False,
    json: Json = False,
) -> None:
    """Measure replay: bounds and estimates against a truth that the replayer does not see.

    For each estimator, every strategy records a log of every task; every other strategy is replayed over it and also
    run in the simulator. inside_bounds should be 1. Calibration is over the replays that are not exact. Costs take
    few distinct values, so intervals contain more than the intended 90 %: compare interval_coverage_closed with
    interval_mass. The probability integral transform has no such bias: its share within the central 90 % is
    interval_coverage, its distance from the uniform distribution is pit_distance, and its histogram of ten bins is
    pit (with --json).

    With --miss-rate, logs are recorded with looks that miss, and each is replayed with --misses K, K being how many
    items its looks overlooked; the truth is a run that overlooks nothing. With --trusting, the recording robot does
    not know that its looks miss, and never looks again: far more stays overlooked.

    With --sees, all robots see open furniture in passing, the recorded and the replayed ones.

    Examples:

        lios evaluate replay -n 200

        lios evaluate replay --houses houses.jsonl.gz --scenarios deliver-3 -n 2000 -j 2 -o replay.csv

        lios evaluate replay --miss-rate 0.2 --scenarios find -n 200
    """
    from replayers.counterfactual.bounds.bounds import budget_of
    from replayers.counterfactual.prepared_log import ReplaySettings
    from replayers.evaluation.trials import MeasurementSettings, outside_bounds, tasks_for
    from workbench.errors import Failed, OutputExists, WrongKind
    from workbench.terminal import say
    from workbench.worlds.perception import missing_at
    from workbench.worlds.sight.lines_of_sight import checked_radius

    missing_at(miss_rate)
    checked_radius(sees)
    if output is not None and output.exists() and not force:
        raise OutputExists(output)
    names, wanted = _asked(strategies, scenarios)
    estimator_names = _estimators(estimators)
    if output is not None and output.is_dir():
        raise WrongKind(output, needed="file")
    tasks = tasks_for(houses, part, wanted, count=count, per_task=len(names) * (len(names) - 1), seed=seed)
    settings = ReplaySettings(
        worlds=worlds,
        budget=budget_of(budget),
        seed=seed,
    )
    plans = [
        MeasurementSettings(
            tasks=tasks,
            strategies=names,
            settings=settings,
            estimator=name,
            miss_rate=miss_rate,
            sees_m=sees,
            trusting=trusting,
        )
        for name in estimator_names
    ]
    each = len(tasks) * len(names) * (len(names) - 1)
    if dry_run:
        by = f" by each of {len(estimator_names)} estimators" if len(estimator_names) > 1 else ""
        say(f"{len(tasks)} tasks, {len(names)} strategies: {each} counterfactuals{by}")
        return
    found, skipped = _measured(plans, (workers, scheduler), total=each * len(plans))
    if not found:
        raise Failed(f"no counterfactual could be measured: {skipped[0].reason if skipped else 'no tasks'}")
    if output is not None:
        _write(output, found)
    faults = outside_bounds(found)
    _answer(found, faults, (estimator_names, wanted), {"skipped": len(skipped), "seed": seed}, as_json=json)
    for one in skipped:
        say(f"skipped {one.task.scenario} in {one.task.house}: {one.reason}")
    unlike = [one for one in skipped if one.fault]
    if unlike:
        raise Failed(f"{len(unlike)} replays of runs that were not reproduced: {unlike[0].reason}")
    if faults:
        raise Failed(f"the truth lies outside the bounds {len(faults)} times in {len(found)}: {faults[0]}")


def _asked(strategies: str, scenarios: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of strategies and scenarios; unknown ones are refused."""
    from replayers.batch.replay_all import strategies_named
    from replayers.counterfactual.sandbox import is_foreign
    from workbench.errors import BadValue
    from workbench.planning.scenarios.paper import family_of
    from workbench.planning.strategies import strategy
    from workbench.plugins import NameOrigin

    names = strategies_named(strategies, with_truth=False)
    wanted = tuple(s.strip() for s in scenarios.split(",") if s.strip())
    for name in names:
        if is_foreign(name, origin=NameOrigin.USER):  # refuses what is no strategy
            strategy(name, origin=NameOrigin.USER)  # refuses what cannot be loaded: each strategy records here, too
    for scenario in wanted:
        family_of(scenario)  # refuses unknown scenarios
    if len(names) < 2:
        raise BadValue("--strategies", strategies, "two or more: each is replayed over the others' logs")
    return names, wanted


def _estimators(text: str) -> tuple[str, ...]:
    """The estimators that a comma-separated list means, each once; what is none is refused."""
    from workbench.beliefs.estimators import estimator
    from workbench.errors import BadValue
    from workbench.plugins import NameOrigin

    names = tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    if not names:
        raise BadValue("--estimator", text, "names with commas between them: fcnn,counts,best")
    for name in names:
        estimator(name, origin=NameOrigin.USER)
    return names


def _measured(
    plans: Sequence[MeasurementSettings], on: tuple[int, str], *, total: int
) -> tuple[list[Counterfactual], list[SkippedTask]]:
    """What was measured and what was skipped, in the order of the plans.

    Args:
        on: the number of workers and the scheduler.
    """
    from itertools import chain

    from replayers.evaluation.trials import SkippedTask, counterfactuals
    from workbench.terminal import progress

    found: list[Counterfactual] = []
    skipped: list[SkippedTask] = []
    workers, scheduler = on
    every = chain.from_iterable(counterfactuals(plan, workers=workers, scheduler=scheduler) for plan in plans)
    for one in progress(every, title="replaying", total=total):
        skipped.append(one) if isinstance(one, SkippedTask) else found.append(one)
    return found, skipped


def _answer(
    found: list[Counterfactual],
    faults: Sequence[Counterfactual],
    axes: tuple[tuple[str, ...], tuple[str, ...]],
    more: dict[str, int],
    *,
    as_json: bool,
) -> None:
    """The figures over all, estimator by estimator and, within each, scenario by scenario.

    Args:
        axes: estimators and scenarios.
    """
    from dataclasses import asdict

    from replayers.evaluation.metrics import summary
    from workbench.terminal import emit_json, emit_table

    estimators, scenarios = axes
    rows: list[dict[str, Any]] = []
    for name in estimators:
        mine = [c for c in found if c.estimator == name]
        rows.append({"estimator": name, "scenario": "all", **summary(mine)})
        rows += [
            {"estimator": name, "scenario": s, **summary([c for c in mine if c.scenario == s])} for s in scenarios
        ]
    if as_json:
        by_estimator = [row for row in rows if row["scenario"] == "all"]
        by_scenario = [row for row in rows if row["scenario"] != "all"]
        outside = [asdict(c) for c in faults]
        emit_json(
            summary(found) | {"by_estimator": by_estimator, "by_scenario": by_scenario, **more, "outside": outside}
        )
    else:
        emit_table([_shown(row) for row in rows if row["counterfactuals"]])


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    names = (
        "estimator", "scenario", "counterfactuals", "inside_bounds", "exact", "exact_or_within_10_percent",
        "interval_coverage_closed", "interval_mass", "interval_coverage", "pit_distance", "not_exact",
        "both_sides_reached", "undetermined_alone", "misses",
    )  # fmt: skip
    return {name: row[name] for name in names}


def _write(path: Path, found: list[Counterfactual]) -> None:
    import csv
    from dataclasses import asdict

    rows = [
        asdict(c) | {"inside": c.inside, "exact": c.exact, "covered": c.covered, "within": c.within} for c in found
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
