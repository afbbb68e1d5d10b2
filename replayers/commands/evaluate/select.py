"""`lios evaluate select`: selectors of the next strategy against each other, on campaigns of simulated trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.options import MOST, DryRun, Force, Houses, Json, Scheduler, Split, Workers
from workbench.parameters import Option

if TYPE_CHECKING:
    from replayers.evaluation.selection_experiment import Campaign, EliminationCheck, SelectorRow
    from replayers.evaluation.selection_pool import PoolTrial
    from replayers.evaluation.trials import MeasurementSettings
    from workbench.evaluation.cluster import Workforce

POOL_FILE, FIGURE_FILE = "pool.jsonl", "regret.png"
TASK_SEEDS = 1000
"""Seeds of tasks that are kept for one pool; the next one's begin after them."""


def select(
    houses: Houses = None,
    part: Split = "test",
    scenario: Annotated[str, Option("--scenario", help="The scenario of every trial.")] = "deliver-3",
    strategies: Annotated[
        str, Option("--strategies", "-s", help="The candidates, separated by commas.")
    ] = "opt-greedy,pes-greedy,opt-lios,pes-lios,model-lios",
    trials: Annotated[int, Option("--trials", "-n", min=1, max=MOST, help="Trials of a campaign.")] = 40,
    seeds: Annotated[int, Option("--seeds", min=2, max=MOST, help="Campaigns of each selector.")] = 30,
    pool: Annotated[int, Option("--pool", min=2, max=MOST, help="Tasks that campaigns draw their trials from.")] = 80,
    pools: Annotated[int, Option("--pools", min=1, max=MOST, help="Pools of tasks; they share no task.")] = 1,
    proofs: Annotated[
        int,
        Option(
            "--proofs",
            min=1,
            max=MOST,
            help="Further campaigns per pool, driven at random, that check eliminations by proof.",
        ),
    ] = 1000,
    estimator: Annotated[str, Option("--estimator", help="Estimator that the runs use.")] = "counts",
    worlds: Annotated[int, Option("--worlds", min=0, max=MOST, help="Worlds sampled for each estimate.")] = 100,
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
    """Measure selection: the cost of finding the best strategy while driving.

    Every strategy drives a pool of tasks once, and each log is replayed by all. A campaign draws its trials from
    the pool; each selector drives one strategy per trial. Regret is what it paid above the best fixed strategy in
    hindsight. "intervals" is lios select; "lower-bounds" is replay with lower bounds only (arXiv:2304.01094); "ucb1"
    and "thompson" are bandits without replay. "replays-alone" and "priors-alone" are the two halves of intervals.
    "full-information" is no competitor but a reference: told after each trial what every strategy truly cost there,
    it drives the one of least mean cost so far. The best strategy so far must never be ruled out by proof.

    Examples:

        lios evaluate select --pool 50 -o selection/

        lios evaluate select --houses houses.jsonl.gz --scenario any-of-three --json
    """
    from workbench.errors import BadValue, Failed, WrongKind
    from workbench.evaluation.cluster import Workforce
    from workbench.terminal import say

    if trials > pool:
        raise BadValue("--trials", trials, f"at most the {pool} tasks of --pool")
    if output is not None and output.exists() and not output.is_dir():
        raise WrongKind(output, needed="folder")
    wanted = (houses, part, scenario, strategies)
    plans = [
        _plan(*wanted, pool=pool, estimator=estimator, worlds=worlds, seed=number)
        for number in range(seed, seed + pools * TASK_SEEDS, TASK_SEEDS)
    ]
    names = plans[0].strategies
    if dry_run:
        tasks = sum(len(plan.tasks) for plan in plans)
        say(f"{tasks} tasks, {len(names)} strategies: {tasks * len(names) ** 2} replays; "
            f"{seeds} seeds of {trials} trials for each of {pools} pools")  # fmt: skip
        return
    on = Workforce(workers, scheduler)
    measured = [
        _measured(
            *_pool(plan, output, on, number=number, force=force),
            number=number, trials=trials, seeds=seeds, seed=seed, proofs=proofs,
        )
        for number, plan in enumerate(plans)
    ]  # fmt: skip
    if output is not None:
        _draw(output / FIGURE_FILE, measured)
    facts = {"trials": trials, "seeds": seeds, "scenario": scenario, "strategies": names, "seed": seed}
    check = _answer(measured, facts, as_json=json)
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
    from workbench.planning.strategies import needs_truth
    from workbench.plugins import NameOrigin

    names = strategies_named(strategies, with_truth=False)
    for name in names:
        if needs_truth(name):
            raise BadValue("--strategies", name, "a strategy that logs can replay: this one knows the whole house")
        is_foreign(name, origin=NameOrigin.USER)  # refuses what is no strategy
    if len(names) < 2:
        raise BadValue("--strategies", strategies, "two or more: there is nothing to choose between")
    family_of(scenario)  # refuses unknown scenarios
    estimator_named(estimator, origin=NameOrigin.USER)
    return MeasurementSettings(
        tasks=tasks_for(houses, part, (scenario,), count=pool, per_task=1, seed=seed),
        strategies=names,
        settings=ReplaySettings(worlds=worlds, seed=seed),
        estimator=estimator,
    )


def _pool(
    plan: MeasurementSettings, output: Path | None, on: Workforce, *, number: int, force: bool
) -> tuple[tuple[PoolTrial, ...], int]:
    """The pool and how many tasks it lacks; what an earlier call into the folder has made is not made again."""
    from dataclasses import replace

    from replayers.evaluation.selection_pool import pool_trials, read_pool, write_pool
    from replayers.evaluation.trials import SkippedTask
    from workbench.errors import Failed, OutputExists
    from workbench.terminal import progress, say

    path = None if output is None else output / (POOL_FILE if number == 0 else f"pool-{number}.jsonl")
    found: list[PoolTrial] = []
    left = plan.tasks
    if path is not None and path.exists() and not force:
        found = list(read_pool(path))
        made = {(t.house, t.scenario, t.seed) for t in found}
        if found[0].seen[0].strategies != plan.strategies or made - {(p.house, p.scenario, p.seed) for p in left}:
            raise OutputExists(path)
        left = tuple(p for p in left if (p.house, p.scenario, p.seed) not in made)
    skipped: list[str] = []
    trials = pool_trials(replace(plan, tasks=left), workers=on.workers, scheduler=on.scheduler)
    for one in progress(trials, title="driving and replaying", total=len(left)):
        if isinstance(one, SkippedTask):
            skipped.append(f"skipped {one.task.scenario} in {one.task.house}: {one.reason}")
            continue
        found.append(one)
        if path is not None:
            write_pool(path, found)
    order = {(p.house, p.scenario, p.seed): place for place, p in enumerate(plan.tasks)}
    found.sort(key=lambda t: order[t.house, t.scenario, t.seed])
    for words in (*skipped, *_broken(plan.strategies, found)):
        say(words)
    if not found:
        raise Failed(f"no trial could be driven: {skipped[0] if skipped else 'there is no task'}")
    if path is not None:
        write_pool(path, found)
    return tuple(found), len(skipped)


def _broken(strategies: Sequence[str], trials: Sequence[PoolTrial]) -> list[str]:
    """One line for each strategy that broke when it was driven."""
    from workbench.terminal import counted

    lines: list[str] = []
    for k, name in enumerate(strategies):
        why = [trial.broke[k] for trial in trials if trial.broke and trial.broke[k]]
        if why:
            lines.append(
                f"{name} broke on {len(why)} of {counted(len(trials), 'task')}, each counted as failed: {why[0]}"
            )
    return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredPool:
    """One pool and what came of it."""

    tasks: tuple[PoolTrial, ...]
    skipped: int
    made: tuple[Campaign, ...]
    check: EliminationCheck


def _measured(
    tasks: tuple[PoolTrial, ...], skipped: int, *, number: int, trials: int, seeds: int, seed: int, proofs: int
) -> MeasuredPool:
    from replayers.evaluation.selection_experiment import campaigns, check_eliminations
    from workbench.terminal import progress

    found = campaigns(tasks, trials=trials, seeds=range(seed, seed + seeds), number=number)
    made = tuple(progress(found, title="selecting"))
    check = check_eliminations(tasks, trials=trials, count=proofs, seed=seed)
    return MeasuredPool(tasks=tasks, skipped=skipped, made=made, check=check)


def _draw(path: Path, measured: Sequence[MeasuredPool]) -> None:
    """Per selector, its cumulative regrets over all campaigns."""
    import numpy as np

    from replayers.evaluation.selection_experiment import REFERENCES
    from replayers.selection.figure import draw_regrets
    from workbench.terminal import say

    made = [c for pool in measured for c in pool.made]
    names = dict.fromkeys(c.selector for c in made)
    regrets = {n: np.array([c.regret for c in made if c.selector == n]) for n in names}
    say(f"Wrote {draw_regrets(path, regrets, references=REFERENCES)}")


def _answer(measured: Sequence[MeasuredPool], facts: dict[str, Any], *, as_json: bool) -> EliminationCheck:
    from replayers.evaluation.selection_experiment import all_checks, selector_rows
    from workbench.terminal import counted, emit_json, emit_table, emit_text

    seed = facts["seed"]
    check = all_checks([pool.check for pool in measured])
    rows = selector_rows([c for pool in measured for c in pool.made], seed=seed)
    of_pools = [_pool_row(k, pool, seed) for k, pool in enumerate(measured)]
    tasks, skipped = sum(len(p.tasks) for p in measured), sum(p.skipped for p in measured)
    if as_json:
        first = of_pools[0]
        emit_json({"rows": _rows(rows), "pools": of_pools, "pool": tasks, "skipped": skipped,
                   "mean_costs": first["mean_costs"], "exact": first["exact"],
                   "eliminations": asdict(check), **facts})  # fmt: skip
        return check
    several = f" for each of {len(measured)} pools" if len(measured) > 1 else ""
    title = (
        f"{facts['scenario']}: {facts['trials']} trials, {facts['seeds']} seeds{several}, {counted(tasks, 'task')}"
    )
    emit_table([_shown(row) for row in _rows(rows)], title=title)
    emit_text("(full-information) is no competitor: after each trial it is told what every strategy truly cost.")
    if len(measured) > 1:
        emit_table(
            [{"pool": row["pool"], "tasks": row["tasks"], "best on average": row["best"],
              **{f"over {_name(r)}": r["intervals_over_this"] for r in row["rows"][1:]}} for row in of_pools],
            title="intervals' regret over each baseline's, pool by pool",
        )  # fmt: skip
    for row in of_pools:
        which = "the pool" if len(of_pools) == 1 else f"pool {row['pool']}"
        costs = ", ".join(f"{name} {cost:.1f}" for name, cost in row["mean_costs"].items())
        emit_text(f"mean cost over {which}: {costs}")
    emit_text(
        f"out by proof: the best so far in {check.wrong_by_proof} of {check.campaigns} campaigns driven at random; "
        f"{100 * check.by_proof:.0f} % of the others after {facts['trials']} trials. By sequence: "
        f"{100 * check.by_sequence:.0f} % of the others."
    )
    return check


def _pool_row(number: int, pool: MeasuredPool, seed: int) -> dict[str, Any]:
    import numpy as np

    from replayers.evaluation.selection_experiment import selector_rows

    means = np.mean([t.true for t in pool.tasks], axis=0)
    costs = dict(zip(pool.tasks[0].seen[0].strategies, (float(m) for m in means), strict=True))
    return {
        "pool": number,
        "tasks": len(pool.tasks),
        "best": min(costs, key=lambda name: costs[name]),
        "mean_costs": costs,
        "exact": float(np.mean([s.exact for t in pool.tasks for s in t.seen])),
        "rows": _rows(selector_rows(pool.made, seed=seed)),
        "eliminations": asdict(pool.check),
    }


def _rows(rows: Sequence[SelectorRow]) -> list[dict[str, Any]]:
    from replayers.evaluation.selection_experiment import OURS, REFERENCES

    shares = next(row.share_of for row in rows if row.selector == OURS)
    found: list[dict[str, Any]] = []
    for row in rows:
        share = shares.get(row.selector)
        found.append(
            {
                "selector": row.selector,
                "reference": row.selector in REFERENCES,
                "regret": row.regret.value,
                "ci95": row.regret.interval,
                "best_share": row.best_share,
                "intervals_over_this": None if share is None else share.value,
                "intervals_over_this_ci95": None if share is None else share.interval,
            }
        )
    return found


def _name(row: dict[str, Any]) -> str:
    """A selector's name; in brackets where it is no competitor."""
    return f"({row['selector']})" if row["reference"] else row["selector"]


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    share, ends = row["intervals_over_this"], row["intervals_over_this_ci95"]
    return {
        "selector": _name(row),
        "cumulative regret": row["regret"],
        "95 % interval": f"{row['ci95'][0]:.1f} to {row['ci95'][1]:.1f}",
        "best driven": row["best_share"],
        "intervals over this": None if share is None else f"{share:.2f} ({ends[0]:.2f} to {ends[1]:.2f})",
    }
