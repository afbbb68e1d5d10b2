"""`lios recover`: saves everything that is intact in a damaged log to a clean one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.options import Force, Json
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json, progress, say

if TYPE_CHECKING:
    from replayers.log_tools.recover import Recovery


def recover(
    log: Annotated[Path, Argument(help="A cut-off or damaged log.")],
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            help="Default: LOG.recovered.mcap beside the log, or in this folder if the log is at an address.",
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Save every intact message of a damaged log to a clean one. Exits with 3 when something had to be dropped.

    Examples:

        lios recover run.mcap -o saved.mcap
    """
    from replayers.log_tools.recover import recover as save
    from workbench.remote.path import RemotePath

    saved = output or (Path() if isinstance(log, RemotePath) else log.parent) / f"{log.stem}.recovered.mcap"
    done = save(log, saved, force=force, progress=lambda records: progress(records, title="recover"))
    if as_json:
        emit_json(_answer(done))
    say(f"Saved {done.messages:,} messages and {done.attachments} attachments to {done.output}.")
    for damage in done.damages[:20]:
        say(f"  byte {damage.offset}: {damage.what}")
    if done.damage_count > 20:
        say(f"  and {done.damage_count - 20} more places")
    if done.expected_messages is not None and done.expected_messages > done.messages:
        say(f"The index counts {done.expected_messages:,} messages: {_lost(done):,} are lost.")
    elif done.end_missing and not done.lossy:
        say("The recording was cut off: its end is missing, and nothing else; nothing that had been flushed is lost.")
    elif not done.was_closed and not done.lossy:
        say("The log was cut off after its last message: its index was lost, and nothing else.")
    raise click.exceptions.Exit(3 if done.lossy else 0)


def _lost(done: Recovery) -> int | None:
    return None if done.expected_messages is None else max(done.expected_messages - done.messages, 0)


def _answer(done: Recovery) -> dict[str, Any]:
    return {
        "file": str(done.source),
        "output": str(done.output),
        "messages": done.messages,
        "attachments": done.attachments,
        "metadata": done.metadata,
        "lossy": done.lossy,
        "was_closed": done.was_closed,
        "end_missing": done.end_missing,
        "messages_expected": done.expected_messages,
        "messages_lost": _lost(done),
        "damages": [{"offset": damage.offset, "what": damage.what} for damage in done.damages],
        "damage_count": done.damage_count,
        "source_bytes": done.source_bytes,
        "output_bytes": done.output_bytes,
    }
