"""`lios replay --verify`: the recorded strategies run again over their own logs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import msgspec

from workbench.errors import BadValue, Failed, LiosError
from workbench.plugins import NameOrigin
from workbench.terminal import counted, emit_json, emit_text, say

if TYPE_CHECKING:
    from replayers.batch.verify import Verification


def recorded_as(strategies: str) -> str:
    """With --verify, the name by which the recorded strategy can be loaded; empty for that in the log."""
    if strategies == "all":
        return ""
    if "," in strategies:
        raise BadValue("--strategies", strategies, "one name with --verify: that of the recorded strategy")
    return strategies.strip()


def verify_logs(logs: list[Path], strategy_name: str, *, json: bool) -> None:
    """Verifies each log and prints what came out; of several logs, those that cannot be verified are named.

    Raises:
        Failed: a log is not what its strategy does.
        LiosError: why the first log cannot be verified, where none can.
        click.exceptions.Exit: with 3, where some cannot.
    """
    from replayers.batch.replay_all import logs_among
    from replayers.batch.verify import verify
    from replayers.runs.run import read

    rows, refused = list[dict[str, Any]](), dict[Path, LiosError]()
    for log in logs_among(logs):
        try:
            answer = verify(read(log, with_truth=True), strategy_name=strategy_name, origin=NameOrigin.USER)
        except LiosError as error:
            refused[log] = error
            continue
        rows.append({"log": str(log), **msgspec.to_builtins(answer)})
        if not json:
            emit_text(_told(log, answer))
    if refused and not rows:
        raise next(iter(refused.values()))
    if json:
        left_out = {"not_verified": {str(log): str(error) for log, error in refused.items()}} if refused else {}
        emit_json({"rows": rows, **left_out})
    for error in refused.values():
        say(f"not verified: {error}")
    different = [row["log"] for row in rows if not row["same"]]
    if different:
        raise Failed(f"{len(different)} of {len(rows)} logs are not what their strategy does: {different[0]}")
    if refused:
        say(f"{counted(len(refused), 'log')} of {len(refused) + len(rows)} could not be verified.")
        raise click.exceptions.Exit(3)


def _told(log: Path, answer: Verification) -> str:
    end = "" if answer.complete else " (the log is cut off; what it holds was compared)"
    if answer.stopped:
        end = f" (the run was stopped: {answer.stopped}; what was recorded until then was compared)"
    d = answer.divergence
    if d is None:
        return f"{log}: {answer.strategy} again, {counted(answer.decisions, 'decision')} the same{end}"
    return (
        f"{log}: first difference in decision {d.decision}, {d.topic} {d.field}: "
        f"logged {d.logged}, replayed {d.replayed}; {d.why}{end}"
    )
