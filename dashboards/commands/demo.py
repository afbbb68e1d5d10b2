"""`lios demo`: records, replays, compares and shows a search in a shipped house."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.parameters import Option

if TYPE_CHECKING:
    from replayers.batch.replay_all import Outcome

HOUSE, ITEM = 9, "mug"
"""The shipped house, and the item to find there."""


def demo(
    output: Annotated[Path, Option("--output", "-o", help="Folder for the log and its replays.")] = Path("demo"),
    no_view: Annotated[bool, Option("--no-view", help="Do not open the dashboard at the end.")] = False,
    port: Annotated[int, Option("--port", help="The dashboard's port; 0 takes any free one.")] = 8080,
    json: Annotated[bool, Option("--json", help="Answer as JSON on standard output; opens no dashboard.")] = False,
) -> None:
    """Record a search, replay every strategy over it, compare, and open the dashboard.

    The robot looks for a mug in a house that ships with the project. Results of an earlier demo in the folder are
    replaced.

    Examples:

        lios demo

        lios demo --no-view -o somewhere
    """
    from recorders.simulated_run import RequestedTask, record_trial, trial_for
    from replayers.batch.replay_all import ReplayRequest, log_path, replay_log, strategies_named
    from replayers.batch.store import replay_path
    from replayers.counterfactual.replay import ReplaySettings
    from replayers.runs.run import read
    from workbench.terminal import counted, emit_json, emit_table, patience, progress, say
    from workbench.worlds.procthor.load import load_house
    from workbench.worlds.shipped import shipped_houses

    log = output / "run.mcap"
    output.mkdir(parents=True, exist_ok=True)
    trial = trial_for(RequestedTask(find=ITEM), load_house(f"{shipped_houses()}:{HOUSE}"), strategy="lios")
    say(f"1. A robot looks for a {ITEM} in {trial.house.plan.name}, by {trial.strategy} (the paper's search policy).")
    with patience():
        end = record_trial(trial, log, force=True)
    say(f"   {end.status}: cost {end.cost:.1f}, {counted(end.searches, 'container')} searched, recorded to {log}")
    say("2. What would every other strategy have cost? From the log alone, and for comparison in the recorded truth:")
    wanted = ReplayRequest(
        strategies=strategies_named("all", with_truth=True),
        settings=ReplaySettings(with_truth=True),
        output=output / "replays",
        write_logs=True,
    )
    replays = progress(replay_log(log, wanted), title="replaying", total=len(wanted.strategies))
    rows = [_row(outcome) for outcome in replays]
    if json:
        emit_json({"log": str(log), "status": end.status, "cost": end.cost, "searches": end.searches, "rows": rows})
        return
    emit_table(rows)
    run = read(log)
    others = [
        log_path(replay_path(wanted.output or output, run.sha256, run.info.run_id, name))
        for name in ("opt-greedy", "conditioned-lios", "oracle")
    ]
    words = " ".join(str(p) for p in (log, *others))
    if no_view:
        say(f"3. Look at it: lios view {words}")
        return
    from dashboards.viser_app.serving import show_until_stopped

    say("3. The run and three replays of it, in 3D:")
    show_until_stopped([log, *others], host="127.0.0.1", port=port, at=0.0, follow=False)


def _row(outcome: Outcome) -> dict[str, Any]:
    from replayers.batch.replay_all import LogFailed
    from replayers.counterfactual.estimates.intervals import finite
    from workbench.errors import Failed

    if isinstance(outcome, LogFailed):
        raise Failed(f"{outcome.log}: {outcome.strategy}: {outcome.reason}")
    bounds, estimate = outcome.bounds, outcome.estimate
    return {
        "strategy": outcome.strategy,
        "status": outcome.status,
        "lower": bounds.lower if bounds else None,
        "upper": finite(bounds.upper) if bounds else None,
        "exact": outcome.exact,
        "estimate": estimate.mean if estimate else None,
        "in_truth": outcome.true_cost,
    }
