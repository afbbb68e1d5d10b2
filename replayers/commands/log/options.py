"""Options that the log tools share, named as in the mcap CLI."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from workbench.errors import BadValue, NotFound
from workbench.parameters import Argument, Option
from workbench.terminal import counted, progress, say

if TYPE_CHECKING:
    from recorders.mcap_io.chunk import Compression
    from replayers.log_tools.copy_log import LogLayout
    from replayers.log_tools.rewrite import MessageFilter
    from replayers.mcap_io.messages import Message
    from replayers.mcap_io.scan import Damage

MAX_LISTED_TOPICS = 60
Log = Annotated[Path, Argument(help="A log.")]
Output = Annotated[Path, Option("-o", "--output", help="The file to make.")]
Force = Annotated[bool, Option("--force", help="Replace the output.")]
Json = Annotated[bool, Option("--json", help="Answer as JSON on standard output.")]
Include = Annotated[
    list[str] | None, Option("-y", "--include-topic-regex", help="Only topics that match; may be repeated.")
]
Exclude = Annotated[
    list[str] | None, Option("-n", "--exclude-topic-regex", help="No topics that match; may be repeated.")
]
Start = Annotated[str, Option("-S", "--start", help="Seconds from the start, RFC 3339, or nanoseconds.")]
End = Annotated[str, Option("-E", "--end", help="As --start; the end itself is excluded.")]
Packing = Annotated[str, Option("--compression", help="zstd, lz4 or none.")]
ChunkSize = Annotated[
    int | None,
    Option(
        "--chunk-size", help="Bytes of a chunk before compression. By default intact chunks stay as they are.", min=1
    ),
]


class NoSuchTopic(NotFound):
    """Topics that a log does not have; the message lists those that it has."""

    def __init__(self, log: Path, wanted: str, there: Sequence[str]) -> None:
        listed = _listed(there) or "none"
        super().__init__(f"{log}: no topic {wanted[:200]}. It has {listed}; expressions match whole names.")


def message_filter(
    log: Path,
    include: list[str] | None,
    exclude: list[str] | None,
    start: str,
    end: str,
    *,
    topics: str = "",
) -> MessageFilter:
    """The messages that the options ask for.

    Args:
        topics: names, separated by commas, beside the expressions to include.

    Raises:
        NoSuchTopic: a named topic that the log does not have, or expressions that leave none of its topics.
        BadValue: an invalid time or expression.
    """
    from replayers.log_tools.info import describe
    from replayers.log_tools.rewrite import MessageFilter, patterns
    from replayers.log_tools.time_argument import moment

    named = [topic.strip() for topic in topics.split(",") if topic.strip()]
    included, excluded = include or [], exclude or []
    about = describe(log) if start or end or named or included or excluded else None
    found = about.index if about else None
    first_ns = 0 if about is None else about.origin.stamp_ns
    start_ns = moment(start, start_ns=first_ns, option="--start") if start else 0
    if about is not None and about.origin.earlier and (start or end):
        say(f"Seconds count from {about.origin.kind}; {counted(about.origin.earlier, 'message')} long before it.")
    end_ns = moment(end, start_ns=first_ns, option="--end") if end else None
    if end_ns is not None and end_ns <= start_ns:
        raise BadValue("--end", end, "after --start")
    wanted = MessageFilter(
        include=(*patterns(included, "--include-topic-regex"), *patterns(map(re.escape, named), "--topics")),
        exclude=patterns(excluded, "--exclude-topic-regex"),
        start_ns=start_ns,
        end_ns=end_ns,
    )
    there = [] if found is None else sorted({channel.topic for channel in found.channels.values()})
    for topic in named:
        if topic not in there:
            raise NoSuchTopic(log, repr(topic), there)
    if there and not any(wanted.topic(topic) for topic in there):
        met = not wanted.include or any(p.fullmatch(topic) for p in wanted.include for topic in there)
        raise NoSuchTopic(log, "that is not excluded" if met else " or ".join(map(repr, [*included, *named])), there)
    _say_unmatched("-y", included, wanted.include, there)
    _say_unmatched("-n", excluded, wanted.exclude, there)
    return wanted


def _say_unmatched(
    option: str, given: Sequence[str], expressions: Sequence[re.Pattern[str]], there: list[str]
) -> None:
    """Says which expressions match no topic: a camera whose name is misspelt would stay in a copy for others."""
    for text, expression in zip(given, expressions, strict=False):
        if there and not any(expression.fullmatch(topic) for topic in there):
            what = "leaves nothing out" if option == "-n" else "takes nothing in"
            say(f"note: {option} {text!r} {what}: no topic is called so. There are {_listed(there)}.")


def _listed(topics: Sequence[str]) -> str:
    more = len(topics) > MAX_LISTED_TOPICS
    return ", ".join(topics[:MAX_LISTED_TOPICS]) + (", ..." if more else "")


def style_of(compression: str, chunk_size: int | None, force: bool) -> LogLayout:
    """The layout of a new log. Chunks of about the size asked for are copied as they stand, without one all."""
    from recorders.mcap_io.writer import CHUNK_BYTES
    from replayers.log_tools.copy_log import LogLayout

    known: dict[str, Compression] = {"zstd": "zstd", "lz4": "lz4", "none": ""}
    if compression not in known:
        raise BadValue("--compression", compression, "zstd, lz4 or none")
    return LogLayout(
        compression=known[compression],
        chunk_bytes=chunk_size or CHUNK_BYTES,
        kept_bytes=None if chunk_size is None else (chunk_size // 4, chunk_size * 2),
        force=force,
    )


def bar(title: str) -> Any:
    """Wraps messages in a progress bar, on a terminal."""

    def wrapped(messages: Iterator[Message]) -> Iterable[Message]:
        return progress(messages, title=title)

    return wrapped


def warn(damage: Damage) -> None:
    """Prints a line about a damage."""
    say(f"byte {damage.offset}: {damage.what}")
