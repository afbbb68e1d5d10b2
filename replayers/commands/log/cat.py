"""`lios log cat`: prints messages as text or JSON, one on each line."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import click

from replayers.commands.log.options import End, Exclude, Include, Log, Start, message_filter, warn
from workbench.parameters import Option
from workbench.terminal import say

if TYPE_CHECKING:
    from replayers.mcap_io.messages import Message
    from replayers.mcap_io.scan import Damage


def cat(
    log: Log,
    topics: Annotated[str, Option("--topics", help="Topics, separated by commas.")] = "",
    include: Include = None,
    exclude: Exclude = None,
    start: Start = "",
    end: End = "",
    limit: Annotated[int, Option(help="Largest number of messages to print; 0 for all.", min=0)] = 0,
    as_json: Annotated[bool, Option("--json", help="One JSON object per line.")] = False,
    whole: Annotated[bool, Option("--whole", help="Show all bytes of binary messages, in base64.")] = False,
) -> None:
    """Print messages, decoded as far as the log explains them.

    Examples:

        lios log cat run.mcap --topics /search/action

        lios log cat run.mcap -y '/search/(action|outcome)' -S 10 -E 20 --json | jq .data.cost
    """
    import msgspec

    from replayers.log_tools.copy_log import ReadLoss
    from replayers.log_tools.decode_message import MessageDecoder
    from replayers.mcap_io.reader import messages

    wanted = message_filter(log, include, exclude, start, end, topics=topics)
    shown, loss = MessageDecoder(whole=whole), ReadLoss()

    def damage(found: Damage) -> None:
        warn(found)
        loss.add(found)

    found = messages(log, topics=wanted.topic, start_ns=wanted.start_ns, end_ns=wanted.end_ns, on_damage=damage)
    count = 0
    for count, message in enumerate(found, start=1):
        if as_json:
            sys.stdout.buffer.write(msgspec.json.encode(shown.line(message)) + b"\n")
        else:
            sys.stdout.write(_readable(message, shown.value(message)) + "\n")
        if count == limit:
            break
    sys.stdout.flush()
    if not count:
        say(f"{log}: no message there{' in that time' if start or end else ''}; lios info {log} shows what is in it.")
    if loss.loses_content:
        say("Something was lost; lios doctor shows what.")
        raise click.exceptions.Exit(3)


def _readable(message: Message, value: Any) -> str:
    import msgspec

    stamp = f"{message.log_time // 10**9}.{message.log_time % 10**9:09d}"
    text = msgspec.json.encode(value).decode("utf-8")
    return f"{stamp} {message.topic} {text if len(text) <= 2000 else text[:1997] + '...'}"
