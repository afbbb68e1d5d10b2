"""`lios log note`: adds a note to a log, or shows its notes."""

from __future__ import annotations

import sys
from typing import Annotated

from replayers.commands.log.options import Json, Log
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json


def note(
    log: Log,
    text: Annotated[str, Argument(help="What to remember. Without it, the notes of the log are shown.")] = "",
    at: Annotated[str, Option("--at", help="Seconds from the start, RFC 3339, or nanoseconds.")] = "",
    until: Annotated[str, Option("--until", help="The end, for a note about a time span.")] = "",
    author: Annotated[str, Option("--author", help="Who says so.")] = "",
    as_json: Json = False,
) -> None:
    """Add a note to a log as a Foxglove event, without rewriting the rest.

    Examples:

        lios log note run.mcap "door was stuck" --at 12.4

        lios log note run.mcap
    """
    from dataclasses import asdict

    from replayers.log_tools.info import describe
    from replayers.log_tools.notes import add_note, notes_of

    if text or at or until or author:
        add_note(log, text, at=at, until=until, author=author)
    found, start_ns = notes_of(log), describe(log).origin.stamp_ns
    if as_json:
        emit_json({"file": str(log), "notes": [asdict(one) for one in found]})
        return
    for one in found:
        who = f" ({one.author})" if one.author else ""
        sys.stdout.write(f"{(one.start_ns - start_ns) / 1e9:10.3f} s  {one.text}{who}\n")
