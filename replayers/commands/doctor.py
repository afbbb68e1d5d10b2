"""`lios doctor`: checks a log and the run in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.errors import LiosError
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

    Of several logs, each is checked; the exit code is that of the worst. With --json: one object for one log,
    {"rows": [...]} for several, with the verdict "no-log" for a file that is none.

    Examples:

        lios doctor run.mcap

        lios doctor logs/*.mcap --json
    """
    from replayers.doctor.examine import examine

    answers, codes = list[dict[str, Any]](), list[int]()
    for log in logs:
        try:
            one = examine(log, progress=lambda parts: progress(parts, title="doctor"))
        except LiosError as error:
            if len(logs) == 1:
                raise
            say(str(error))
            answers.append(_no_log(log, error))
            codes.append(error.exit_code)
            continue
        answers.append(_answer(one))
        codes.append(one.verdict.exit_code)
        if not as_json:
            _tell(one)
    if as_json:
        emit_json(answers[0] if len(answers) == 1 else {"rows": answers})
    raise click.exceptions.Exit(worst(codes))


def worst(codes: list[int]) -> int:
    """The worst of several exit codes: faulty, then no log, then lossy, then fine."""
    return next((code for code in (1, 2) if code in codes), max(codes, default=0))


def _no_log(log: Path, error: LiosError) -> dict[str, Any]:
    """The row of a file that cannot be examined; the same fields as those of a log."""
    return {
        "file": str(log),
        "verdict": "no-log",
        "findings": [{"level": "error", "where": "", "what": str(error), "fix": ""}],
        "loss_window_s": None,
        "loss_window_measured": False,
        "longest_chunk_s": None,
        "messages": 0,
        "holds_run": False,
    }


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
