"""`lios evaluate replay`: measures bounds and estimates of replay against a hidden truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.options import DryRun, Force, Houses, Json, Split, Workers

if TYPE_CHECKING:
    from replayers.replay_trials import Counterfactual, Plan, Skipped


def replay(
    houses: Houses = None,
    part: Split = "test",
    scenarios: Annotated[
        str, typer.Option("--scenarios", help="Scenarios, separated by commas, taken in turn.")
    ] = "find,deliver-3,any-of-three",
    strategies: Annotated[
        str, typer.Option("--strategies", "-s", help="Each records a log and is replayed over the others' logs.")
    ] = "all",
    count: Annotated[
        int,
        typer.Option(
            "--counterfactuals", "-n", min=1, help="The least number of counterfactuals; whole tasks are measured."
        ),
    ] = 2000,
    estimator: Annotated[str, typer.Option("--estimator", help="What the runs believe.")] = "counts",
    worlds: Annotated[int, typer.Option("--worlds", min=0, help="Worlds sampled for each estimate.")] = 200,
    budget: Annotated[
        int,
        typer.Option(
            "--budget",
            min=1,
            help="Pieces of run, from one unopened container to the next, that the bounds of one replay may take.",
        ),
    ] = 400,
    workers: Workers = 1,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the tasks and of the sampled worlds.")] = 0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="A CSV file with every counterfactual.")
    ] = None,
    force: Force = False,
    dry_run: DryRun = False,
    json: Json = False,
) -> None:
    """Measure bounds and estimates of replay against a truth that the replayer does not see.

    Every strategy records a log of every task; every other strategy is replayed over it and also run in the
    simulator. inside_bounds should be 1. Calibration is over the replays that are not exact. Costs are discrete,
    so that intervals contain more than the nominal 90 %: compare interval_coverage_closed with interval_mass. The
    probability integral transform (PIT) has no such bias: its share within the central 90 % is interval_coverage, its
    distance from the uniform distribution pit_distance, its ten histogram bars pit (with --json).

    Examples:

        lios evaluate replay -n 200

        lios evaluate replay --houses houses.jsonl.gz --scenarios deliver-3 -n 2000 -j 2 -o replay.csv
    """
    from replayers.bounds import Budget
    from replayers.ground import Settings
    from replayers.replay_trials import Plan, outside, places_for
    from workbench.errors import Failed, OutputExists, WrongKind
    from workbench.terminal import say

    if output is not None and output.exists() and not force:
        raise OutputExists(output)
    names, wanted = _asked(strategies, scenarios)
    if output is not None and output.is_dir():
        raise WrongKind(output, needed="file")
    places = places_for(houses, part, wanted, count=count, per_place=len(names) * (len(names) - 1), seed=seed)
    settings = Settings(worlds=worlds, budget=Budget(stretches=budget), seed=seed)
    plan = Plan(places=places, strategies=names, settings=settings, estimator=estimator)
    total = len(places) * len(names) * (len(names) - 1)
    if dry_run:
        say(f"{len(places)} tasks, {len(names)} strategies: {total} counterfactuals")
        return
    found, skipped = _measured(plan, workers=workers, total=total)
    if not found:
        raise Failed(f"no counterfactual could be measured: {skipped[0].reason if skipped else 'no tasks'}")
    if output is not None:
        _write(output, found)
    faults = outside(found)
    _answer(found, faults, wanted, {"skipped": len(skipped), "seed": seed}, as_json=json)
    for one in skipped:
        say(f"skipped {one.place.scenario} in {one.place.house}: {one.reason}")
    if faults:
        raise Failed(f"the truth lies outside the bounds {len(faults)} times in {len(found)}: {faults[0]}")


def _asked(strategies: str, scenarios: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of strategies and scenarios; unknown ones are refused."""
    from replayers.batch import strategies_named
    from replayers.sandbox import is_foreign
    from workbench.errors import BadValue
    from workbench.planning.scenarios import family_of

    names = strategies_named(strategies, with_truth=False)
    wanted = tuple(s.strip() for s in scenarios.split(",") if s.strip())
    for name in names:
        is_foreign(name)  # refuses unknown strategies
    for scenario in wanted:
        family_of(scenario)  # refuses unknown scenarios
    if len(names) < 2:
        raise BadValue("--strategies", strategies, "two or more: each is replayed over the others' logs")
    return names, wanted


def _measured(plan: Plan, *, workers: int, total: int) -> tuple[list[Counterfactual], list[Skipped]]:
    from replayers.replay_trials import Skipped, counterfactuals
    from workbench.terminal import progress

    found: list[Counterfactual] = []
    skipped: list[Skipped] = []
    for one in progress(counterfactuals(plan, workers=workers), title="replaying", total=total):
        skipped.append(one) if isinstance(one, Skipped) else found.append(one)
    return found, skipped


def _answer(
    found: list[Counterfactual],
    faults: Sequence[Counterfactual],
    scenarios: tuple[str, ...],
    more: dict[str, int],
    *,
    as_json: bool,
) -> None:
    """The figures over all scenarios, and for each."""
    from dataclasses import asdict

    from replayers.replay_figures import summary
    from workbench.terminal import emit_json, emit_table

    answer: dict[str, Any] = dict(summary(found))
    by_scenario = [{"scenario": s, **summary([c for c in found if c.scenario == s])} for s in scenarios]
    if as_json:
        emit_json(answer | {"by_scenario": by_scenario, **more, "outside": [asdict(c) for c in faults]})
    else:
        counted = [_shown(str(row["scenario"]), row) for row in by_scenario if row["counterfactuals"]]
        emit_table([_shown("all", answer), *counted])


def _shown(title: str, row: dict[str, Any]) -> dict[str, Any]:
    names = (
        "counterfactuals", "inside_bounds", "exact", "exact_or_within_10_percent", "interval_coverage_closed",
        "interval_mass", "interval_coverage", "pit_distance", "not_exact", "both_sides_reached",
        "undetermined_alone",
    )  # fmt: skip
    return {"scenario": title, **{name: row[name] for name in names}}


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
