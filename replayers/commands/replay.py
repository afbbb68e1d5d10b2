"""`lios replay`: replays planners over recorded logs, with bounds and estimates of their costs."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.errors import BadValue, LiosError
from workbench.options import (
    MOST,
    Ask,
    BoundsBudget,
    Json,
    LogEstimator,
    MemoryLogs,
    MoveRatesFile,
    Scheduler,
    Upload,
)
from workbench.parameters import Argument, Option
from workbench.terminal import counted

if TYPE_CHECKING:
    from replayers.batch.next_look import ContainerLook
    from replayers.batch.replay_all import LogFailed
    from workbench.beliefs.memory.history import History

BROKE, UNLIKE = "planner-failed", "not-reproduced"
SHOWN_ELSEWHERE = {"done", "undetermined", "not-replayed", BROKE, UNLIKE}
"""Statuses whose reason is shown in a column, with the log or at the end; other reasons are shown below the table."""


def replay(
    logs: Annotated[list[Path], Argument(help="Logs, or folders of logs.")],
    strategies: Annotated[
        str,
        Option("--strategies", "--strategy", "-s", help='Names separated by commas, "module:Class", or "all".'),
    ] = "all",
    verify: Annotated[
        bool,
        Option(
            "--verify",
            help="Run the recorded strategy again and compare every decision; --strategies names your own.",
        ),
    ] = False,
    with_truth: Annotated[bool, Option("--with-truth", help="Also run in the recorded ground truth.")] = False,
    output: Annotated[
        Path | None, Option("--output", "-o", help="Folder for the replays (JSON and MCAP); resumes there.")
    ] = None,
    estimator: LogEstimator = "log",
    ask: Ask = False,
    worlds: Annotated[
        int, Option("--worlds", min=0, max=MOST, help="Worlds sampled for the estimate; 0 for none.")
    ] = 200,
    budget: BoundsBudget = None,
    unique: Annotated[bool, Option("--unique", help="Assume no instances beyond those that the log shows.")] = False,
    no_inventory: Annotated[
        bool, Option("--no-inventory", help="Do not treat the task's item list as complete.")
    ] = False,
    misses: Annotated[
        int | None,
        Option(
            "--misses",
            min=0,
            help="How many items the recorded looks may have overlooked; default: as many as the inventory implies.",
        ),
    ] = None,
    timeout: Annotated[
        float, Option("--timeout", min=0.1, help="Time limit of your own planner for a decision, in seconds.")
    ] = 10.0,
    look_next: Annotated[
        bool,
        Option(
            "--look-next",
            help="Show which unopened container to open next: the one that would settle the most comparisons.",
        ),
    ] = False,
    write: Annotated[
        str,
        Option(
            "--write",
            help="With -o, also record the run in consistent worlds: best, worst, drawn (separated by commas).",
        ),
    ] = "",
    in_process: Annotated[
        bool,
        Option(
            "--in-process",
            help="Run your own planner in this process, without a time limit: breakpoint() stops in it.",
        ),
    ] = False,
    memory: MemoryLogs = None,
    rates: MoveRatesFile = None,
    workers: Annotated[
        int | None, Option("--workers", "-j", min=1, help="Number of processes; default: one for each core.")
    ] = None,
    scheduler: Scheduler = "",
    upload: Upload = "",
    seed: Annotated[int, Option("--seed", help="Seed of the drawn worlds.")] = 0,
    json: Json = False,
) -> None:
    """Replay other planners over logs: what would they have cost?

    lower and upper hold in every world that is consistent with the log; estimate is a mean over sampled worlds.

    Examples:

        lios replay run.mcap --strategies all

        lios replay run.mcap --strategies greedy,my_planner:Mine --json

        lios replay logs/ --strategies all -o replays/ && lios compare replays/

        lios replay run.mcap --misses 1

        lios replay run.mcap --memory logs/

        lios replay run.mcap --verify
    """
    given = dict(locals())
    if verify:
        from replayers.commands.verify_logs import recorded_as, verify_logs
        from workbench.parameters import require_left_out

        taken = ("logs", "strategies", "verify", "workers", "json")
        require_left_out(replay, given, but=taken, where="with --verify, which runs what was recorded as it was")
        verify_logs(logs, recorded_as(strategies), json=json)
        return
    import replayers
    from replayers.batch.replay_all import LogFailed
    from replayers.batch.replay_rows import pair_rows, replay_row
    from replayers.counterfactual.bounds.bounds import budget_of
    from replayers.counterfactual.logged_belief import may_ask_estimator
    from replayers.counterfactual.prepared_log import ReplaySettings
    from replayers.counterfactual.relevance import Assumptions
    from workbench.beliefs.memory.move_rates import read_rates
    from workbench.errors import Failed
    from workbench.plugins import NameOrigin
    from workbench.remote.upload import require_upload, send
    from workbench.terminal import emit_json, progress, say

    if upload:
        require_upload(upload, output)
    settings = ReplaySettings(
        estimator=estimator,
        estimator_origin=NameOrigin.USER,
        ask=may_ask_estimator(estimator, ask=ask),
        worlds=worlds,
        budget=budget_of(budget),
        assumptions=Assumptions(inventory=not no_inventory, unique=unique, misses=misses),
        with_truth=with_truth,
        timeout_s=timeout,
        in_process=in_process,
        histories=_histories(memory, rates, logs),
        rates=None if rates is None else read_rates(rates),
        seed=seed,
    )
    made = replayers.replay(
        logs,
        strategies,
        settings=settings,
        output=output,
        worlds=_worlds_named(write, output),
        workers=workers,
        scheduler=scheduler,
        # A bar would write over a debugger's prompt.
        progress=None if in_process else lambda replays, total: progress(replays, title="replaying", total=total),
    )
    outcomes, not_there = list(made.outcomes), made.not_loaded
    failed = [o for o in outcomes if isinstance(o, LogFailed)]
    if len(failed) == len(outcomes):
        _refuse(failed)
    if upload and output is not None:
        send(output, upload)
    rows = [replay_row(o) for o in outcomes]
    next_look = [_look(look) for look in replayers.look_next(made)] if look_next else None
    if json:
        answer: dict[str, Any] = {"rows": rows, "pairs": pair_rows(outcomes), "seed": seed}
        if next_look is not None:
            answer["look_next"] = next_look
        emit_json(answer)
    else:
        _show(rows, next_look, several=len({o.log for o in outcomes}) > 1)
        if next_look == []:
            none_left = "no strategy looks into a container that was left unopened, or no worlds could be drawn"
            undrawn = "what a look would show is judged by drawn worlds, and --worlds is 0"
            say(f"no look is advised: {none_left if worlds else undrawn}")
    for failure in failed:
        if failure.reason.startswith(failure.log):
            say(failure.reason)
        elif failure.strategy not in not_there:
            say(f"{failure.log} {failure.strategy}: {failure.reason}")
    failures = [f"{name} cannot be loaded: {why}" for name, why in not_there.items()] + _unlike(rows) + _broken(rows)
    if failures:
        raise Failed("; ".join(failures))
    if any(row.get("lost") for row in rows):
        _say_lost(rows)
        raise click.exceptions.Exit(3)


def _say_lost(rows: list[dict[str, Any]]) -> None:
    """Says what is missing from the logs, where no note on a replay says so already."""
    from workbench.terminal import say

    noted = {(row["log"], note) for row in rows for note in row.get("notes") or ()}
    for log, line in dict.fromkeys((row["log"], line) for row in rows for line in row.get("lost") or ()):
        if not any(of == log and line in note for of, note in noted):
            say(f"note: {log} is not whole: {line}")


def _histories(memory: list[Path] | None, rates: Path | None, logs: list[Path]) -> tuple[History, ...]:
    """The earlier runs that strategies are to remember, by place of the logs; none for what the robot remembered."""
    if not memory:
        if rates is not None:
            raise BadValue("--rates", str(rates), "given together with --memory")
        return ()
    from replayers.batch.replay_all import logs_among
    from replayers.memory.collect import earlier_logs, places_of
    from workbench.terminal import say

    earlier = earlier_logs(memory)
    places = places_of(logs_among(logs))
    histories: list[History] = []
    errors: list[LiosError] = []
    for place in places:
        try:
            histories.append(earlier.of_place(place))
        except LiosError as error:
            errors.append(error)
    if errors and not histories:
        raise errors[0]
    for note in dict.fromkeys(note for history in histories for note in history.notes):
        say(f"note: {note}")
    for error in errors:
        say(f"note: {error}")
    return tuple(histories)


def _worlds_named(text: str, output: Path | None) -> tuple[str, ...]:
    from replayers.counterfactual.replay import WORLDS

    names = tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    if not set(names) <= set(WORLDS):
        raise BadValue("--write", text, f"names with commas between them of {', '.join(WORLDS)}")
    if names and output is None:
        raise BadValue("--write", text, "given together with -o DIR, the folder to write to")
    return names


def _notes(rows: list[dict[str, Any]]) -> dict[str, tuple[str, ...]]:
    """Every note, with the names of the logs that it is about."""
    found: dict[str, dict[str, None]] = {}
    for row in rows:
        for note in row.get("notes") or ():
            found.setdefault(note, {})[Path(row["log"]).name] = None
    return {note: tuple(logs) for note, logs in found.items()}


def _about(logs: tuple[str, ...]) -> str:
    return f" on {', '.join(logs)}" if len(logs) <= 3 else f" on {len(logs)} logs"


def _show(rows: list[dict[str, Any]], next_look: list[dict[str, Any]] | None, *, several: bool) -> None:
    from replayers.counterfactual.logged_belief import LEARNS
    from workbench.terminal import emit_table, emit_text, say

    shown = []
    for row in rows:
        shown.append(
            {
                **({"log": Path(row["log"]).name} if several else {}),
                "strategy": row["strategy"],
                "status": row["status"],
                "lower": row["lower"],
                "upper": row["upper"],
                "bounds": _proof(row),
                "if beliefs stand": _between(row.get("if_beliefs_stand")),
                "estimate": row["estimate"],
                "90 % of drawn worlds": _interval(row),
                "in truth": row.get("true_cost"),
                "not opened": row.get("unseen"),
                "seconds": _seconds(row),
            }
        )
    for column in ("if beliefs stand", "in truth", "seconds"):
        if all(line[column] is None for line in shown):
            shown = [{k: v for k, v in line.items() if k != column} for line in shown]
    emit_table(shown, minor=("90 % of drawn worlds", "seconds", "if beliefs stand", "not opened", "bounds"))
    conditional = any(row.get("if_beliefs_stand") for row in rows)
    for note, logs in _notes(rows).items():
        if conditional or not note.endswith(LEARNS):
            say(f"note{_about(logs) if several else ''}: {note}")
    stopped = (f"{row['strategy']}: {row['reason']}" for row in rows if row["status"] not in SHOWN_ELSEWHERE)
    for words in dict.fromkeys(stopped):
        say(words)
    if next_look:
        from replayers.batch.next_look import NO_LOOK

        for look in next_look[:3]:
            advice = "" if look["words"] == NO_LOOK else f"look into {look['container']}: "
            emit_text(f"{Path(look['log']).name}: {advice}{look['words']}")


def _interval(row: dict[str, Any]) -> str | None:
    """The shortest interval that contains at least 90 % of the sampled worlds, and the share that it contains."""
    if row.get("interval90") is None:
        return None
    low, high = row["interval90"]
    holds = "" if row["exact"] else f" ({row['interval90_mass'] * 100:.0f} %)"
    return f"{low:.1f} to {high:.1f}{holds}"


def _between(bounds: dict[str, float | None] | None) -> str | None:
    if not bounds:
        return None
    lower, upper = bounds["lower"], bounds["upper"]
    return f"at least {lower:.1f}" if upper is None else f"{lower:.1f} to {upper:.1f}"


def _seconds(row: dict[str, Any]) -> str | None:
    """The duration predicted by a robot's own speeds, with the error that their residuals leave where it is known."""
    if row.get("durations") is None:
        return None
    until = " until it stops" if row["status"] == "undetermined" else ""
    error = "" if row["seconds_rms"] is None else f" ± {row['seconds_rms']:.0f}"
    return f"{row['seconds']:.0f}{error}{until}"


def _proof(row: dict[str, Any]) -> str | None:
    if row["lower"] is None:
        return None
    if row["exact"]:
        return "exact"
    sides = [side for side in ("lower", "upper") if row[f"{side}_proof"] not in ("exact", "none")]
    outer = f"{' and '.join(sides)}: outer" if sides else ""
    unbounded = "no upper bound" if row["upper_proof"] == "none" else ""
    return ", ".join(words for words in (outer, unbounded) if words) or "both sides reached"


def _unlike(rows: list[dict[str, Any]]) -> list[str]:
    """Logs whose recorded strategy does not do what was recorded: how many, and how on the first."""
    why = {row["log"]: row["reason"] for row in rows if row["status"] == UNLIKE}
    if not why:
        return []
    log, reason = next(iter(why.items()))
    return [f"{len(why)} of {counted(len({row['log'] for row in rows}), 'log')} not reproduced: {log}: {reason}"]


def _broken(rows: list[dict[str, Any]]) -> list[str]:
    """Strategies that broke: on how many of their logs, and why on the first; the rows give each reason."""
    why: dict[str, list[str]] = {}
    for row in rows:
        if row["status"] == BROKE:
            why.setdefault(row["strategy"], []).append(row["reason"])
    ran = Counter(row["strategy"] for row in rows)
    return [f"{name} broke on {len(r)} of {counted(ran[name], 'log')}: {r[0]}" for name, r in why.items()]


def _refuse(failed: list[LogFailed]) -> None:
    from workbench.errors import Unsupported

    first = failed[0]
    more = f" (and {len(failed) - 1} more)" if len(failed) > 1 else ""
    raise Unsupported(
        f"{first.reason}{more}"
        if first.reason.startswith(first.log)
        else f"{first.log}: {first.strategy}: {first.reason}{more}"
    )


def _look(look: ContainerLook) -> dict[str, Any]:
    from dataclasses import asdict

    return {"log": look.log, **asdict(look.value), "words": look.words}
