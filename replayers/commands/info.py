"""`lios info`: what is in a log, at a glance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click

from workbench.options import Json
from workbench.parameters import Argument
from workbench.terminal import emit_json, emit_table, emit_text, say

if TYPE_CHECKING:
    from replayers.log_tools.info import Description


def info(
    log: Annotated[Path, Argument(help="A log.")],
    as_json: Json = False,
) -> None:
    """Show what is in a log: run, duration, channels, attachments.

    Examples:

        lios info run.mcap

        lios info run.mcap --json | jq .run.strategy
    """
    from replayers.log_tools.info import describe

    found = describe(log)
    if as_json:
        emit_json(_answer(found))
        _end(found)
        return
    for name, value in _lines(found):
        emit_text(f"{name + ':':13}{value}")
    channels = found.channels()
    stamps = ["stamps"] if any(row["stamps"] for row in channels) else []
    emit_table(channels, columns=["topic", "schema", "encoding", "messages", *stamps, "hz"])
    _end(found)


def _end(found: Description) -> None:
    """Ends with 3 where something had to be dropped."""
    if found.loss.loses_content:
        say("Something was lost; lios doctor shows what.")
        raise click.exceptions.Exit(3)


def _answer(found: Description) -> dict[str, Any]:
    index = found.index
    return {
        "file": str(found.path),
        "size_bytes": found.size_bytes,
        "library": index.header.library if index.header else "",
        "profile": index.header.profile if index.header else "",
        "closed": found.closed,
        "indexed": found.indexed,
        "damages": found.loss.count,
        "messages": index.messages,
        "start_ns": index.first_ns,
        "end_ns": index.last_ns,
        "origin_ns": found.origin.stamp_ns,
        "seconds_from": found.origin.kind,
        "duration_s": found.duration_s,
        "chunks": len(index.chunks),
        "compression_ratio": found.compression_ratio,
        "run": _run(found),
        "runs": found.runs,
        "outcome": found.outcome,
        "channels": found.channels(),
        "attachments": [
            {"name": a.name, "media_type": a.media_type, "size_bytes": a.data_size} for a in index.attachments
        ],
        "metadata": found.metadata,
    }


def _run(found: Description) -> dict[str, Any] | None:
    if found.info is None:
        return None
    names = ("run_id", "place", "scenario", "strategy", "estimator", "seed", "title", "source", "origin_run")
    return {name: getattr(found.info, name) for name in names} | {"schema_version": found.info.schema_version}


def _lines(found: Description) -> list[tuple[str, str]]:
    from replayers.log_tools.recovered import RECOVERED_METADATA, Recovered

    index, run, outcome = found.index, found.info, found.outcome
    lines: list[tuple[str, str]] = []
    if run is not None:
        lines += [
            ("run", f"{run.run_id}, {run.title or run.scenario}"),
            ("place", run.place),
            ("strategy", f"{run.strategy}, belief of {run.estimator}, seed {run.seed}"),
            ("source", run.source + (f" of run {run.origin_run}" if run.origin_run else "")),
        ]
        end = "none recorded"
        if outcome:
            end = f"{outcome.get('status')}, cost {_rounded(outcome.get('cost', ''))}, {outcome.get('reason')}"
        lines.append(("outcome", end))
    elif found.runs:
        lines.append(("runs", f"{found.runs}; lios log split --by run takes them apart"))
    cut = "".join(f", cut off at byte {damage.offset}" for damage in found.loss.damages if damage.cut_off)
    state = "closed" if found.closed else f"not closed{cut}; lios recover rebuilds its index"
    if found.closed and not found.indexed:
        state += ", without a whole index: all of it was read"
    if found.loss.count and found.closed:
        state += f"; {found.loss.count} damages, see lios doctor"
    ratio = "" if found.compression_ratio is None else f", compressed {found.compression_ratio:.1f} times"
    lines += [
        ("file", f"{found.size_bytes:,} bytes, {state}"),
        ("library", index.header.library if index.header else "unknown"),
        ("messages", f"{index.messages:,} in {len(index.chunks)} chunks{ratio}"),
        ("start", _when(index.first_ns)),
        ("duration", f"{found.duration_s:.3f} s from {_origin(found)}"),
        ("attachments", ", ".join(f"{a.name} ({a.data_size:,} bytes)" for a in index.attachments) or "none"),
        ("metadata", ", ".join(sorted(found.metadata)) or "none"),
    ]
    copied = Recovered.from_facts(found.metadata.get(RECOVERED_METADATA, {})).words
    return [*lines, ("lost", copied)] if copied else lines


def _origin(found: Description) -> str:
    origin = found.origin
    if not origin.earlier:
        return origin.kind
    earlier = f"{origin.earlier} message{'' if origin.earlier == 1 else 's'}"
    return f"{origin.kind} at {_when(origin.stamp_ns)}, without {earlier} long before"


def _rounded(number: str) -> str:
    try:
        return f"{float(number):.1f}"
    except ValueError:
        return number or "unknown"


def _when(stamp_ns: int) -> str:
    from datetime import UTC, datetime

    try:
        text = datetime.fromtimestamp(stamp_ns // 10**9, tz=UTC).strftime("%Y-%m-%dT%H:%M:%S")
    except (OverflowError, ValueError, OSError):
        return f"{stamp_ns} ns"
    return f"{text}.{stamp_ns % 10**9:09d}Z"
