"""A log as lines of JSON: one message on each line, decoded as far as the log describes it."""

from __future__ import annotations

from pathlib import Path

import msgspec

from replayers.log_tools.copy_log import NoDiskSpace, ReadLoss, contents
from replayers.log_tools.decode_message import MessageDecoder
from replayers.log_tools.rewrite import Progress, RewriteReport, require_distinct_output
from replayers.mcap_io.messages import Message
from workbench.errors import CannotCreate, OutputExists
from workbench.files import draft_path, file_to_replace, remove_abandoned_drafts, replace


def to_lines(log: Path, output: Path, *, force: bool, progress: Progress = iter) -> RewriteReport:
    """Writes a log's messages to a .jsonl file, which is renamed to its final name when it is complete.

    Raises:
        OutputExists, CannotCreate, WrongKind, NoDiskSpace: nothing was written.
        BadValue: output and log are the same file.
    """
    require_distinct_output([log], output)
    output = file_to_replace(output)
    if output.exists() and not force:
        raise OutputExists(output)
    shown, loss, count = MessageDecoder(whole=True), ReadLoss(), 0
    found = (part for part in contents(log, loss) if isinstance(part, Message))
    draft = draft_path(output)
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        stream = open(draft, "wb")  # noqa: SIM115 - closed below
    except OSError as error:
        raise CannotCreate(output, error.strerror or str(error)) from error
    remove_abandoned_drafts(output.parent)
    try:
        with stream:
            for message in progress(found):
                stream.write(msgspec.json.encode(shown.line(message)) + b"\n")
                count += 1
        if output.exists() and not force:
            raise OutputExists(output)
        replace(draft, output)
    except OSError as error:
        raise NoDiskSpace(output, error.strerror or str(error)) from error
    finally:
        draft.unlink(missing_ok=True)
    return RewriteReport(outputs=(output,), messages=count, dropped=0, loss=loss)
