"""`lios log cat | filter | merge | split | compact | convert | note`: container tools, as the mcap CLI has them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.errors import BadValue, Unsupported
from workbench.terminal import emit_json, progress, say

if TYPE_CHECKING:
    from recorders.chunk import Compression
    from replayers.content import Message
    from replayers.copying import Style
    from replayers.rewriting import Rewritten

Log = Annotated[Path, typer.Argument(help="A log.")]
Output = Annotated[Path, typer.Option("-o", "--output", help="The file to make.")]
Force = Annotated[bool, typer.Option("--force", help="Replace an output that exists.")]
Json = Annotated[bool, typer.Option("--json", help="For machines, to standard output.")]
Include = Annotated[
    list[str] | None, typer.Option("-y", "--include-topic-regex", help="Only topics that match; may be repeated.")
]
Exclude = Annotated[
    list[str] | None, typer.Option("-n", "--exclude-topic-regex", help="No topics that match; may be repeated.")
]
Start = Annotated[str, typer.Option("-S", "--start", help="Seconds from the start, RFC 3339, or nanoseconds.")]
End = Annotated[str, typer.Option("-E", "--end", help="The same; the end itself is not included.")]
Packing = Annotated[str, typer.Option("--compression", help="zstd, lz4 or none.")]
ChunkSize = Annotated[int, typer.Option("--chunk-size", help="Bytes of a chunk before it is packed.", min=1)]


def cat(
    log: Log,
    topics: Annotated[str, typer.Option("--topics", help="Topics, separated by commas.")] = "",
    include: Include = None,
    exclude: Exclude = None,
    start: Start = "",
    end: End = "",
    limit: Annotated[int, typer.Option(help="At most so many messages; 0 is all.", min=0)] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
    whole: Annotated[bool, typer.Option("--whole", help="Show all bytes of binary messages, in base64.")] = False,
) -> None:
    """Print messages, decoded as far as the log explains them.

    Examples:

        lios log cat run.mcap --topics /search/action

        lios log cat run.mcap -y '/search/.*' -S 10 -E 20 --json | jq .data.cost
    """
    import msgspec

    from replayers.reader import messages
    from replayers.showing import Shown

    wanted = _wanted(log, [*(include or []), *_literal(topics)], exclude, start, end)
    shown = Shown(whole=whole)
    found = messages(log, topics=wanted.topic, start_ns=wanted.start_ns, end_ns=wanted.end_ns, on_damage=_warn)
    for count, message in enumerate(found, start=1):
        if as_json:
            sys.stdout.buffer.write(msgspec.json.encode(shown.line(message)) + b"\n")
        else:
            sys.stdout.write(_readable(message, shown.value(message)) + "\n")
        if count == limit:
            break
    sys.stdout.flush()


def filter_log(
    log: Log,
    output: Output,
    include: Include = None,
    exclude: Exclude = None,
    start: Start = "",
    end: End = "",
    attachments: Annotated[bool, typer.Option(help="Keep attachments.")] = True,
    metadata: Annotated[bool, typer.Option(help="Keep metadata.")] = True,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = 1 << 20,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Copy the wanted topics and times to another log; topics that nobody here knows pass untouched.

    Examples:

        lios log filter run.mcap -o small.mcap -n '/camera/.*' -S 10 -E 60
    """
    from dataclasses import replace

    from replayers.rewriting import filtered

    wanted = replace(_wanted(log, include, exclude, start, end), attachments=attachments, metadata=metadata)
    _tell(filtered(log, output, wanted, _style(compression, chunk_size, force), _bar("filter")), as_json)


def merge(
    logs: Annotated[list[Path], typer.Argument(help="Logs, or the parts of one.")],
    output: Output,
    allow_duplicates: Annotated[
        bool, typer.Option("--allow-duplicates", help="Keep metadata and attachments of one name that differ.")
    ] = False,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = 1 << 20,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Join logs by time: the parts of a split log, or a run with the camera log recorded beside it.

    Examples:

        lios log merge run_0000.mcap run_0001.mcap -o run.mcap
    """
    from replayers.rewriting import merged

    style = _style(compression, chunk_size, force)
    _tell(merged(logs, output, style, allow_duplicates=allow_duplicates, told=_bar("merge")), as_json)


def split(
    log: Log,
    output: Output,
    every: Annotated[float | None, typer.Option("--every", help="Seconds of log time a part.")] = None,
    size: Annotated[int | None, typer.Option("--size", help="Bytes a part.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Cut a log into parts OUTPUT_0000.mcap, OUTPUT_0001.mcap, ...; each opens alone.

    Examples:

        lios log split run.mcap -o parts/run.mcap --every 60
    """
    from replayers.copying import Style
    from replayers.rewriting import split_up

    _tell(split_up(log, output, Style(force=force), part_s=every, part_bytes=size, told=_bar("split")), as_json)


def compact(
    log: Log,
    output: Output,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = 4 << 20,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Pack a log into few large chunks: smaller and faster to read than one that was synced at every decision.

    Examples:

        lios log compact run.mcap -o small.mcap
    """
    from replayers.rewriting import Wanted, filtered

    _tell(filtered(log, output, Wanted(), _style(compression, chunk_size, force), _bar("compact")), as_json)


def convert(
    log: Log,
    output: Output,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = 1 << 20,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Convert a log by the output's ending: .mcap with another compression, or .jsonl with every message decoded.

    Examples:

        lios log convert run.mcap -o run.jsonl

        lios log convert run.mcap -o plain.mcap --compression none
    """
    from replayers.rewriting import Wanted, filtered

    if output.suffix == ".jsonl":
        _tell(_to_lines(log, output, force), as_json)
    elif output.suffix == ".mcap":
        _tell(filtered(log, output, Wanted(), _style(compression, chunk_size, force), _bar("convert")), as_json)
    else:
        raise UnknownFormat(output)


def note(
    log: Log,
    text: Annotated[str, typer.Argument(help="What to remember. Without it, the notes of the log are shown.")] = "",
    at: Annotated[str, typer.Option("--at", help="Seconds from the start, RFC 3339, or nanoseconds.")] = "",
    until: Annotated[str, typer.Option("--until", help="For a note about a stretch of time.")] = "",
    author: Annotated[str, typer.Option("--author", help="Who says so.")] = "",
    as_json: Json = False,
) -> None:
    """Add a note to a log as a Foxglove event, without rewriting the rest.

    Examples:

        lios log note run.mcap "door was stuck" --at 12.4

        lios log note run.mcap
    """
    from dataclasses import asdict

    from replayers.describe import describe
    from replayers.notes import add_note, notes_of

    if text:
        add_note(log, text, at=at, until=until, author=author)
    found, start_ns = notes_of(log), describe(log).index.first_ns
    if as_json:
        emit_json({"file": str(log), "notes": [asdict(one) for one in found]})
        return
    for one in found:
        who = f" ({one.author})" if one.author else ""
        sys.stdout.write(f"{(one.start_ns - start_ns) / 1e9:10.3f} s  {one.text}{who}\n")


class UnknownFormat(Unsupported):
    """An output whose ending says nothing."""

    def __init__(self, output: Path) -> None:
        super().__init__(
            f"{output}: only .mcap and .jsonl can be written here; lios export writes .parquet and .csv."
        )


def _wanted(log: Path, include: list[str] | None, exclude: list[str] | None, start: str, end: str) -> Any:
    from replayers.describe import describe
    from replayers.rewriting import Wanted, patterns
    from replayers.times import moment

    first_ns = describe(log).index.first_ns if start or end else 0
    start_ns = moment(start, start_ns=first_ns, option="--start") if start else 0
    end_ns = moment(end, start_ns=first_ns, option="--end") if end else None
    if end_ns is not None and end_ns <= start_ns:
        raise BadValue("--end", end, "after --start")
    return Wanted(
        include=patterns(include or [], "--include-topic-regex"),
        exclude=patterns(exclude or [], "--exclude-topic-regex"),
        start_ns=start_ns,
        end_ns=end_ns,
    )


def _literal(topics: str) -> list[str]:
    import re

    return [re.escape(topic.strip()) for topic in topics.split(",") if topic.strip()]


def _style(compression: str, chunk_size: int, force: bool) -> Style:
    from replayers.copying import Style

    known: dict[str, Compression] = {"zstd": "zstd", "lz4": "lz4", "none": ""}
    if compression not in known:
        raise BadValue("--compression", compression, "zstd, lz4 or none")
    return Style(compression=known[compression], chunk_bytes=chunk_size, force=force)


def _bar(title: str) -> Any:
    def told(messages: Iterator[Message]) -> Iterable[Message]:
        return progress(messages, title=title)

    return told


def _to_lines(log: Path, output: Path, force: bool) -> Rewritten:
    import msgspec

    from replayers.copying import Loss
    from replayers.reader import messages
    from replayers.rewriting import Rewritten
    from replayers.showing import Shown
    from workbench.errors import OutputExists

    if output.exists() and not force:
        raise OutputExists(output)
    shown, loss, count = Shown(whole=True), Loss(), 0
    found = messages(log, on_damage=loss.add)
    draft = output.with_name(f".{output.name}.part")
    try:
        with open(draft, "wb") as stream:
            for message in progress(found, title="convert"):
                stream.write(msgspec.json.encode(shown.line(message)) + b"\n")
                count += 1
        draft.replace(output)
    finally:
        draft.unlink(missing_ok=True)
    return Rewritten(outputs=(output,), messages=count, dropped=0, loss=loss)


def _tell(done: Rewritten, as_json: bool) -> None:
    if as_json:
        emit_json(
            {
                "outputs": [{"file": str(path), "size_bytes": path.stat().st_size} for path in done.outputs],
                "messages": done.messages,
                "left_out": done.dropped,
                "damages": [{"offset": damage.offset, "what": damage.what} for damage in done.loss.damages],
            }
        )
    for path in done.outputs:
        say(f"{path}: {path.stat().st_size:,} bytes")
    say(f"{done.messages:,} messages" + (f", {done.dropped:,} left out" if done.dropped else ""))
    for damage in done.loss.damages[:5]:
        _warn(damage)
    if any(damage.costs_content for damage in done.loss.damages) or done.loss.messages:
        say("Something was lost; lios doctor tells more.")
        raise typer.Exit(3)


def _warn(damage: Any) -> None:
    say(f"byte {damage.offset}: {damage.what}")


def _readable(message: Message, value: Any) -> str:
    import msgspec

    stamp = f"{message.log_time // 10**9}.{message.log_time % 10**9:09d}"
    text = msgspec.json.encode(value).decode("utf-8")
    return f"{stamp} {message.topic} {text if len(text) <= 2000 else text[:1997] + '...'}"
