"""`lios doctor`: checks a log and the run in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.options import Json
from workbench.parameters import Argument
from workbench.terminal import emit_json, emit_text, progress, say

if TYPE_CHECKING:
    from replayers.doctor.examine import Examination


def doctor(
    logs: Annotated[list[Path], Argument(help="Logs.")],
    as_json: Json = False,
) -> None:
    """Check a log: the file, and the run in it. Exit codes: 0 fine, 1 faulty, 2 not a log, 3 something is missing.

    With --json: one object for one log, {"rows": [...]} for several.

    Examples:

        lios doctor run.mcap

        lios doctor logs/*.mcap --json
    """
    from replayers.doctor.examine import examine

    examined = [examine(log, progress=lambda parts: progress(parts, title="doctor")) for log in logs]
    if as_json:
        answers = [_answer(one) for one in examined]
        emit_json(answers[0] if len(answers) == 1 else {"rows": answers})
    else:
        for one in examined:
            _tell(one)
    raise click.exceptions.Exit(worst([one.verdict.exit_code for one in examined]))


def worst(codes: list[int]) -> int:
    """The worst of several exit codes: faulty before lossy before fine."""
    return 1 if 1 in codes else max(codes, default=0)


def _answer(one: Examination) -> dict[str, Any]:
    return {
        "file": str(one.file),
        "verdict": one.verdict.value,
        "findings": [{"level": f.level.value, "where": f.where, "what": f.what, "fix": f.fix} for f in one.findings],
        "loss_window_s": round(one.loss_window_s, 6),
        "loss_window_measured": one.loss_window_measured,
        "longest_chunk_s": round(one.longest_chunk_s, 6),
        "messages": one.messages,
        "holds_run": one.holds_run,
    }


def _tell(one: Examination) -> None:
    emit_text(f"{one.file}: {one.verdict.value}, {one.messages:,} messages")
    for finding in one.findings:
        fix = f" {finding.fix}." if finding.fix else ""
        emit_text(f"  {finding.level.value:8}{finding.where + ': ' if finding.where else ''}{finding.what}.{fix}")
    emit_text(f"  {_loss_window(one)}")
    if one.verdict.exit_code:
        say(f"{one.file} is {one.verdict.value}.")


def _loss_window(one: Examination) -> str:
    if one.loss_window_measured:
        return f"At most {one.loss_window_s:.3f} s of this recording would be lost in a crash."
    whose = "the bag that was imported" if one.source == "import" else "a simulated world"
    return (
        f"At most {one.loss_window_s:.3f} s would be lost in a crash: "
        f"the recorder's setting, since the stamps are those of {whose}."
    )
