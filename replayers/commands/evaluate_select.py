"""`lios evaluate select`: selectors of the next strategy against each other, on campaigns of simulated trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import DryRun, Force, Houses, Json, Scheduler, Split, Workers
from workbench.parameters import Option

if TYPE_CHECKING:
    from replayers.evaluation.selection_experiment import Campaign, EliminationCheck, SelectorRow
    from replayers.evaluation.selection_pool import PoolTrial
    from replayers.evaluation.trials import MeasurementSettings

POOL_FILE, FIGURE_FILE = "pool.jsonl", "regret.png"


def select(
    houses: Houses = None,
    part: Split = "test",
    scenario: Annotated[str, Option("--scenario", help="The scenario of every trial.")] = "deliver-3",
    strategies: Annotated[
        str, Option("--strategies", "-s", help="The candidates, by comma.")
    ] = "opt-greedy,pes-greedy,opt-lios,pes-lios,model-lios",
    trials: Annotated[int, Option("--trials", "-n", min=1, help="Trials of a campaign.")] = 40,
    seeds: Annotated[int, Option("--seeds", min=2, help="Campaigns of each selector.")] = 30,
    pool: Annotated[int, Option("--pool", min=2, help="Tasks that campaigns draw their trials from.")] = 80,
    proofs: Annotated[
        int, Option("--proofs", min=1, help="Further campaigns, driven at random, that check eliminations by proof.")
    ] = 1000,
    estimator: Annotated[str, Option("--estimator", help="Whose beliefs the runs use.")] = "counts",
    worlds: Annotated[int, Option("--worlds", min=0, help="Worlds sampled for each estimate.")] = 100,
    workers: Workers = 1,
    scheduler: Scheduler = "",
    seed: Annotated[int, Option("--seed", help="Seed of the tasks, of orders and of selectors.")] = 0,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Folder for the pool and a figure; a second call reuses the pool.")
    ] = None,
    force: Force = False,
    dry_run: DryRun = False,
    json: Json = False,
) -> None:
    """Measure selection: what does it cost to find the best strategy while driving?

    A pool of tasks is driven by every strategy and each log replayed by all, once. A campaign draws its trials from
    it; each selector drives one strategy a trial. Regret is what it paid above the best fixed strategy in hindsight.
    intervals is lios select; lower-bounds is replay with lower bounds only (arXiv:2304.01094); ucb1 and thompson are
    bandits without replay. The best strategy so far must never be out by proof.

    Examples:

        lios evaluate select --pool 50 -o selection/

        lios evaluate select --houses houses.jsonl.gz --scenario any-of-three --json
    """
    from replayers.evaluation.selection_experiment import check_eliminations
    from workbench.errors import Failed
    from workbench.terminal import say

    plan = _plan(houses, part, scenario, strategies, pool=pool, estimator=estimator, worlds=worlds, seed=seed)
    if dry_run:
        k = len(plan.strategies)
        say(f"{len(plan.places)} tasks, {k} strategies: {len(plan.places) * k * k} replays; "
            f"{seeds} seeds of {trials} trials")  # fmt: skip
        return
    tasks, skipped = _pool(plan, output, (workers, scheduler), force=force)
    rows, regrets = _measured(tasks, trials=trials, seeds=seeds, seed=seed)
    check = check_eliminations(tasks, trials=trials, count=proofs, seed=seed)
    if output is not None:
        from replayers.selection.figure import draw_regrets

        say(f"Wrote {draw_regrets(output / FIGURE_FILE, regrets)}")
    facts = {"pool": len(tasks), "skipped": skipped, "trials": trials, "seeds": seeds, "scenario": scenario,
             "strategies": plan.strategies, "seed": seed}  # fmt: skip
    _answer(rows, check, facts, tasks, as_json=json)
    if check.wrong_by_proof:
        raise Failed(f"the best strategy was out by proof in {check.wrong_by_proof} of {check.campaigns} campaigns")


def _plan(
    houses: Path | None,
    part: str,
    scenario: str,
    strategies: str,
    *,
    pool: int,
    estimator: str,
    worlds: int,
    seed: int,
) -> MeasurementSettings:
    from replayers.batch.replay_all import strategies_named
    from replayers.counterfactual.prepared_log import ReplaySettings
    from replayers.counterfactual.sandbox import is_foreign
    from replayers.evaluation.trials import MeasurementSettings, tasks_for
    from workbench.beliefs.estimators import estimator as estimator_named
    from workbench.errors import BadValue
    from workbench.planning.scenarios.paper import family_of
    from workbench.plugins import NameOrigin

    names = strategies_named(strategies, with_truth=False)
    for name in names:
        is_foreign(name, origin=NameOrigin.USER)  # refuses what is no strategy
    if len(names) < 2:
        raise BadValue("--strategies", strategies, "two or more: there is nothing to choose between")
    family_of(scenario)  # refuses unknown scenarios
    estimator_named(estimator, origin=NameOrigin.USER)
    return MeasurementSettings(
        places=tasks_for(houses, part, (scenario,), count=pool, per_place=1, seed=seed),
        strategies=names,
        settings=ReplaySettings(worlds=worlds, seed=seed),
        estimator=estimator,
    )


def _pool(
    plan: MeasurementSettings, output: Path | None, on: tuple[int, str], *, force: bool
) -> tuple[tuple[PoolTrial, ...], int]:
    """The pool and how many tasks it lacks; what an earlier call into the folder has made is not made again.

    Args:
        on: the number of workers and the scheduler.
    """
    from dataclasses import replace

    from replayers.evaluation.selection_pool import pool_trials, read_pool, write_pool
    from replayers.evaluation.trials import SkippedTask
    from workbench.errors import Failed, OutputExists
    from workbench.terminal import progress, say

    path = output / POOL_FILE if output is not None else None
    found: list[PoolTrial] = []
    left = plan.places
    if path is not None and path.exists() and not force:
        found = list(read_pool(path))
        made = {(t.house, t.scenario, t.seed) for t in found}
        if found[0].seen[0].strategies != plan.strategies or made - {(p.house, p.scenario, p.seed) for p in left}:
            raise OutputExists(path)
        left = tuple(p for p in left if (p.house, p.scenario, p.seed) not in made)
    skipped: list[str] = []
    workers, scheduler = on
    trials = pool_trials(replace(plan, places=left), workers=workers, scheduler=scheduler)
    for one in progress(trials, title="driving and replaying", total=len(left)):
        if isinstance(one, SkippedTask):
            skipped.append(f"skipped {one.place.scenario} in {one.place.house}: {one.reason}")
            continue
        found.append(one)
        if path is not None:
            write_pool(path, found)
    order = {(p.house, p.scenario, p.seed): number for number, p in enumerate(plan.places)}
    found.sort(key=lambda t: order[t.house, t.scenario, t.seed])
    for words in skipped:
        say(words)
    if not found:
        raise Failed(f"no trial could be driven: {skipped[0] if skipped else 'there is no task'}")
    if path is not None:
        write_pool(path, found)
    return tuple(found), len(skipped)


def _measured(
    tasks: Sequence[PoolTrial], *, trials: int, seeds: int, seed: int
) -> tuple[tuple[SelectorRow, ...], dict[str, Any]]:
    """The selectors' rows, and per selector its cumulative regrets, shape (seeds, trials)."""
    import numpy as np

    from replayers.evaluation.selection_experiment import best_in_hindsight, campaigns, selector_rows
    from workbench.terminal import progress

    numbers = range(seed, seed + seeds)
    made: list[Campaign] = list(progress(campaigns(tasks, trials=trials, seeds=numbers), title="selecting"))
    rows = selector_rows(made, lambda s: best_in_hindsight(tasks, trials=trials, seed=s), seed=seed)
    regrets = {row.selector: np.array([c.regret for c in made if c.selector == row.selector]) for row in rows}
    return rows, regrets


def _answer(
    rows: Sequence[SelectorRow],
    check: EliminationCheck,
    facts: dict[str, Any],
    tasks: Sequence[PoolTrial],
    *,
    as_json: bool,
) -> None:
    from dataclasses import asdict

    import numpy as np

    from replayers.evaluation.selection_experiment import OURS
    from workbench.terminal import emit_json, emit_table, emit_text

    means = np.mean([t.true for t in tasks], axis=0)
    costs = dict(zip(tasks[0].seen[0].strategies, (float(m) for m in means), strict=True))
    exact = float(np.mean([s.exact for t in tasks for s in t.seen]))
    shares = next(row.share_of for row in rows if row.selector == OURS)
    if as_json:
        emit_json({"rows": [{"selector": r.selector, "regret": r.regret.value, "ci95": r.regret.interval,
                             "best_share": r.best_share, "intervals_over_this": shares.get(r.selector)}
                            for r in rows],
                   "mean_costs": costs, "exact": exact, "eliminations": asdict(check), **facts})  # fmt: skip
        return
    emit_table(
        [
            {
                "selector": r.selector,
                "cumulative regret": r.regret.value,
                "95 % interval": f"{r.regret.lower:.1f} to {r.regret.upper:.1f}",
                "best driven": r.best_share,
                "intervals over this": shares.get(r.selector),
            }
            for r in rows
        ],
        title=f"{facts['scenario']}: {facts['trials']} trials, {facts['seeds']} seeds, {facts['pool']} tasks",
    )
    emit_text("mean cost over the pool: " + ", ".join(f"{name} {cost:.1f}" for name, cost in costs.items()))
    emit_text(
        f"out by proof: the best so far in {check.wrong_by_proof} of {check.campaigns} campaigns driven at random; "
        f"{100 * check.by_proof:.0f} % of the others after {facts['trials']} trials. By sequence: "
        f"{100 * check.by_sequence:.0f} % of the others."
    )
