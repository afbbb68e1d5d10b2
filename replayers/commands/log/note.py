"""`lios log note`: adds a note to a log, or shows its notes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from replayers.commands.log.options import Json, Log
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json


def note(
    log: Log,
    text: Annotated[str, Argument(help="The note. Without it, the notes of the log are shown.")] = "",
    at: Annotated[str, Option("--at", help="Seconds from the start, RFC 3339, or nanoseconds.")] = "",
    until: Annotated[str, Option("--until", help="End of a note about a time span.")] = "",
    author: Annotated[str, Option("--author", help="Author of the note.")] = "",
    seen: Annotated[
        str,
        Option(
            "--seen",
            help="ITEM@CONTAINER, a correction: the item was there although no look showed it. Replays take it as "
            "certain. --at defaults to the first look there.",
        ),
    ] = "",
    as_json: Json = False,
) -> None:
    """Add a note to a log as a Foxglove event, without rewriting the rest.

    Examples:

        lios log note run.mcap "door was stuck" --at 12.4

        lios log note run.mcap --seen mug@desk --at 41.2 --author Ada

        lios log note run.mcap
    """
    from dataclasses import asdict

    from replayers.log_tools.info import describe
    from replayers.log_tools.notes import add_note, notes_of

    if seen:
        _correct(log, seen, text, at=at, until=until, author=author)
    elif text or at or until or author:
        add_note(log, text, at=at, until=until, author=author)
    found, start_ns = notes_of(log), describe(log).origin.stamp_ns
    if as_json:
        emit_json({"file": str(log), "notes": [asdict(one) for one in found]})
        return
    for one in found:
        who = f" ({one.author})" if one.author else ""
        sys.stdout.write(f"{(one.start_ns - start_ns) / 1e9:10.3f} s  {one.text}{who}\n")


def _correct(log: Path, seen: str, text: str, *, at: str, until: str, author: str) -> None:
    """Adds a correction, once it is known to be one of this run."""
    from replayers.counterfactual.evidence import evidence_of
    from replayers.log_tools.info import describe
    from replayers.log_tools.notes import add_note
    from replayers.log_tools.time_argument import moment
    from replayers.runs.correcting import read_correction
    from replayers.runs.run import read
    from workbench.errors import BadValue

    if until:
        raise BadValue("--until", until, "left out with --seen")
    run = read(log)
    evidence = evidence_of(run)
    stamp_ns = moment(at, start_ns=describe(log).origin.stamp_ns, option="--at") if at else None
    found = read_correction(seen, run, evidence.contents, evidence.known, stamp_ns=stamp_ns, author=author)
    add_note(log, text or found.words, author=author, seen=found)
