"""`lios select`: which strategy to drive next, from the logs of the trials so far."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.options import MOST, Ask, BoundsBudget, Json, Workers
from workbench.parameters import Argument, Option
from workbench.tolerances import NEAR_COST

if TYPE_CHECKING:
    from replayers.batch.next_look import SharedLook
    from replayers.batch.replays import Replays
    from replayers.selection.campaign_logs import TrialGroup, TrialGroups
    from replayers.selection.verdict import SelectionSettings, SelectionVerdict, StrategyStanding


def select(
    logs: Annotated[list[Path], Argument(help="Logs of the trials, or folders of logs.")],
    strategies: Annotated[
        str,
        Option("--strategies", "-s", help='The candidates, separated by commas: names, "module:Class", or "all".'),
    ] = "all",
    group: Annotated[
        str, Option("--group-by", help="What trials must share to count together: scenario, site or task.")
    ] = "scenario",
    horizon: Annotated[
        int | None, Option("--horizon", min=1, help="Number of trials in all, including those driven so far.")
    ] = None,
    alpha: Annotated[
        float,
        Option("--alpha", min=0.0001, max=0.5, help="Probability of any wrong elimination by sequence."),
    ] = 0.05,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Folder that keeps the replays; a second call resumes there.")
    ] = None,
    figure: Annotated[
        Path | None,
        Option("--figure", help="Write a PNG of standings and regret over the trials of the largest group."),
    ] = None,
    force: Annotated[bool, Option("--force", help="Replace the file of --figure.")] = False,
    estimator: Annotated[
        str,
        Option("--estimator", help="Estimator of the beliefs; of several, separated by commas, each is a candidate."),
    ] = "log",
    ask: Ask = False,
    worlds: Annotated[int, Option("--worlds", min=0, max=MOST, help="Worlds sampled for each estimate.")] = 100,
    budget: BoundsBudget = None,
    look_next: Annotated[
        bool,
        Option(
            "--look-next", help="Show which container, had it been opened, would have settled the most over all logs."
        ),
    ] = False,
    workers: Workers = 1,
    seed: Annotated[int, Option("--seed", help="Seed of drawn worlds and of resampling.")] = 0,
    json: Json = False,
) -> None:
    """Select the strategy to drive in the next trial.

    Every candidate is replayed over every log. The tables say, after each trial, which one to drive next, which are
    ruled out, and how much regret is still possible. "By proof": on the trials so far it cost more than another one
    in every world that agrees with the logs. "By sequence" is about coming trials like these, with an error
    probability of --alpha.

    Examples:

        lios select logs/ --strategies pes-greedy,pes-lios,conditioned-lios

        lios select trials/ -o replays/ --look-next --figure selection.png --json

        lios select trials/ -s conditioned-lios --estimator by-room.prompt,by-sight.prompt --ask
    """
    from replayers.batch.replay_all import LogFailed
    from replayers.counterfactual.bounds.bounds import budget_of
    from replayers.counterfactual.logged_belief import may_ask_estimator
    from replayers.counterfactual.prepared_log import ReplaySettings
    from replayers.selection.campaign_logs import group_by, trial_groups
    from replayers.selection.candidates import estimators_named, replay_candidates
    from replayers.selection.kept_answer import keep_answer
    from replayers.selection.next_look import looks_of_trials
    from replayers.selection.verdict import SelectionSettings, history
    from workbench.errors import BadValue, Unsupported
    from workbench.plugins import NameOrigin
    from workbench.terminal import progress, say

    by = group_by(group)
    if figure is not None:
        _require_png(figure, force=force)
    settings = ReplaySettings(
        estimator_origin=NameOrigin.USER,
        ask=may_ask_estimator(estimator, ask=ask),
        worlds=worlds,
        budget=budget_of(budget),
        seed=seed,
    )
    made = replay_candidates(
        logs,
        strategies,
        estimators_named(estimator),
        settings=settings,
        output=output,
        workers=workers,
        progress=lambda replays, total: progress(replays, title="replaying", total=total),
    )
    found = trial_groups(made, _candidates(made, strategies), by)
    wanted = SelectionSettings(alpha=alpha, horizon=horizon, seed=seed)
    if output is not None:
        keep_answer(output, made, wanted, estimators=estimators_named(estimator), group_by=by)
    if not found.groups:
        raise Unsupported(f"no log can be compared: {found.left_out[0] if found.left_out else 'there is none'}")
    most = max(len(g.trials) for g in found.groups)
    if horizon is not None and horizon < most:
        raise BadValue("--horizon", horizon, f"at least the {most} trials so far")
    histories = [history(g.trials, wanted) for g in found.groups]
    looks = looks_of_trials(made, found.groups) if look_next else None
    _answer(found, histories, looks, wanted, worlds=worlds, as_json=json)
    if figure is not None:
        from replayers.selection.figure import draw_campaign

        say(f"Wrote {draw_campaign(figure, histories[0], title=found.groups[0].name)}")
    if any(isinstance(o, LogFailed) for o in made.outcomes) or any(group.broke for group in found.groups):
        raise click.exceptions.Exit(3)


def _answer(
    found: TrialGroups,
    histories: Sequence[Sequence[SelectionVerdict]],
    looks: Sequence[SharedLook] | None,
    wanted: SelectionSettings,
    *,
    worlds: int,
    as_json: bool,
) -> None:
    """Prints the answer of each group, what to look into next, and what counts for nothing."""
    from replayers.selection.next_look import look_lines
    from replayers.selection.verdict_text import beliefs_apart, out_of_choice
    from workbench.terminal import emit_json, say

    advised = () if looks is None else look_lines(looks, trials=len(found.logs), worlds=worlds)
    if as_json:
        groups = [_group_row(g, h) for g, h in zip(found.groups, histories, strict=True)]
        answer: dict[str, Any] = {
            "groups": groups,
            "left_out": found.left_out,
            "not_replayed": [{"strategy": name, "reason": why} for name, why in found.not_replayed.items()],
            "alpha": wanted.alpha,
            "seed": wanted.seed,
        }
        if looks is not None:
            answer |= {"look_next": [_look(look) for look in looks], "look_next_words": advised}
        emit_json(answer)
    else:
        if len(histories) > 1:
            say(f"These logs are of {len(histories)} kinds of trial; each has its own answer (--group-by).")
        for words in beliefs_apart([g.beliefs for g in found.groups]):
            say(words)
        for g, h in zip(found.groups, histories, strict=True):
            _tell(g, h, alpha=wanted.alpha)
        for line in advised:
            say(line)
    for words in out_of_choice(found.not_replayed):
        say(words)
    for words in found.left_out:
        say(f"left out: {words}")


def _require_png(figure: Path, *, force: bool) -> None:
    """Refuses, before anything is replayed, a place where no PNG can be written; makes its folder."""
    from workbench.errors import BadValue, WrongKind
    from workbench.files import make_folder

    if figure.is_dir():
        raise WrongKind(figure, needed="file")
    if figure.suffix.lower() != ".png":
        raise BadValue("--figure", str(figure), "a file that ends in .png")
    if figure.exists() and not force:
        raise BadValue("--figure", str(figure), "a file that is not there yet, unless --force is given")
    make_folder(figure.parent)


def _candidates(made: Replays, strategies: str) -> tuple[str, ...]:
    """The candidates that were replayed, by the names that they give themselves, in the order asked for."""
    from workbench.errors import BadValue, Unsupported

    names = tuple(dict.fromkeys(replay.strategy for replay in made))
    others = [f for f in made.failed if f.strategy and f.strategy not in names]
    if len(names) == 1 and others:
        raise Unsupported(f"only {names[0]} can be replayed. {others[0].strategy}: {others[0].reason}")
    if len(names) == 1:
        more = "two or more, or several by --estimator: there is nothing to choose between"
        raise BadValue("--strategies", strategies, more)
    return names


def _group_row(group: TrialGroup, verdicts: Sequence[SelectionVerdict]) -> dict[str, Any]:
    return {
        "group": group.name,
        "beliefs": group.beliefs or None,
        "places": group.places,
        "logs": [str(log) for log in group.logs],
        "broke": [{"strategy": name, "logs": logs, "reason": why} for name, (logs, why) in group.broke.items()],
        "next": verdicts[-1].next,
        "settled": verdicts[-1].settled.value or None,
        "after": [_verdict(v) for v in verdicts],
    }


def _verdict(v: SelectionVerdict) -> dict[str, Any]:
    from dataclasses import asdict

    from replayers.counterfactual.estimates.intervals import finite

    return {
        "trials": v.trials,
        "next": v.next,
        "settled": v.settled.value or None,
        "trials_to_settle": v.trials_to_settle,
        "regret_so_far_at_most": finite(v.regret_so_far),
        "regret_to_come_at_most": v.regret_to_come
        if v.regret_to_come < v.regret_to_come_unknown - NEAR_COST
        else None,
        "same": v.same,
        "by_proof": [asdict(e) for e in v.by_proof],
        "by_sequence": [asdict(e) for e in v.by_sequence],
        "rows": [
            {**asdict(s), "upper": finite(s.upper), "regret_so_far": finite(s.regret_so_far)} for s in v.standings
        ],
    }


def _look(look: SharedLook) -> dict[str, Any]:
    from dataclasses import asdict

    return asdict(look)


def _tell(group: TrialGroup, verdicts: Sequence[SelectionVerdict], *, alpha: float) -> None:
    from replayers.selection.verdict_text import at_most, summary
    from workbench.terminal import counted, emit_table, emit_text, say

    last = verdicts[-1]
    steps = [{"trial": v.trials, "log": group.logs[i].name, "drive next": v.next,
              "out by proof": ", ".join(e.strategy for e in v.by_proof) or "none",
              "out by sequence": ", ".join(e.strategy for e in v.by_sequence) or "none",
              "regret so far": at_most(v.regret_so_far)} for i, v in enumerate(verdicts)]  # fmt: skip
    title = f"{group.name}: {counted(len(verdicts), 'trial')} in {counted(len(group.places), 'place')}"
    emit_table(steps, title=title, minor=("out by sequence",))
    emit_table([_standing(s, last) for s in last.standings], minor=("driven", "exact"))
    emit_text(summary(last, alpha=alpha))
    for name, (logs, why) in group.broke.items():
        say(f"left out of the choice: {name} broke on {len(logs)} of {counted(len(verdicts), 'log')}: {why}")


def _standing(s: StrategyStanding, last: SelectionVerdict) -> dict[str, Any]:
    from replayers.selection.verdict_text import expected_cost, mean_cost, standing_words

    return {
        "strategy": s.strategy,
        "driven": s.driven,
        "exact": s.exact,
        "mean cost": mean_cost(s),
        "expected": expected_cost(s) if any(other.middles for other in last.standings) else s.expected,
        "to come": s.to_come,
        "chance best": s.chance_best,
        "standing": standing_words(s.strategy, last),
    }
