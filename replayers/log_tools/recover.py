"""Recovers every intact message of a damaged log into a clean file with a new index.

Intact chunks are copied as they stand. Declarations of the whole file are collected only when one is missing, because
a lost chunk held it. Memory holds one record at a time, whatever the file claims.

Why not mcap's own reader: it ends at the first record that is damaged.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Header, Metadata

from replayers.log_tools.copy_log import LogCopier, LogLayout, ReadLoss, pieces_at, profile_of
from replayers.log_tools.read_ahead import read_ahead
from replayers.log_tools.recovered import SourceLoss
from replayers.mcap_io.scan import Damage, open_log
from replayers.mcap_io.summary import is_closed, read_summary
from workbench.errors import BadValue
from workbench.log_schema.run_info import INFO_METADATA
from workbench.log_schema.settings_json import SETTINGS_ATTACHMENT, identity_in
from workbench.remote.path import path_of

Progress = Callable[[Iterator[Any]], Iterable[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """The result of a recovery.

    Attributes:
        messages, attachments, metadata: how many were saved.
        damages: the first damages that were skipped; damage_count counts all of them.
        messages_lost: messages whose channel is not declared anywhere; those inside lost chunks cannot be counted
            unless the index is intact: expected_messages then says how many there were.
        was_closed: the log had its index; False for one whose recorder was killed.
        end_missing: the log ends early, so that messages may have been recorded that never came to be written.
    """

    source: Path
    output: Path
    messages: int
    attachments: int
    metadata: int
    damages: tuple[Damage, ...]
    damage_count: int
    messages_lost: int
    expected_messages: int | None
    was_closed: bool
    end_missing: bool
    source_bytes: int
    output_bytes: int

    @property
    def lossy(self) -> bool:
        """Whether anything was dropped. A log that merely was not closed loses nothing that had been flushed."""
        missing = self.expected_messages is not None and self.expected_messages != self.messages
        return missing or self.messages_lost > 0 or any(damage.loses_content for damage in self.damages)


def recover(source: Path | str, output: Path | str, *, force: bool = False, progress: Progress = iter) -> Recovery:
    """Saves the intact part of a log to another file.

    Args:
        progress: wraps the pieces of the log as they are copied, for a progress bar.

    Raises:
        FileMissing, NoMcap: there is nothing to read.
        OutputExists, CannotCreate, NoDiskSpace: the output cannot be written; no partial file is left.
        BadValue: output and source are the same file.
    """
    source, output = path_of(source), Path(output)
    with open_log(source) as stream:
        summary, closed = read_summary(stream), is_closed(stream)
        source_bytes = stream.seek(0, io.SEEK_END)
    if output.exists() and output.samefile(source):
        raise BadValue("output", str(output), "another file than the log itself")
    expected = summary.statistics.message_count if summary and summary.statistics else None
    loss = ReadLoss()
    lost = SourceLoss(name=source.name, loss=loss, expected=expected)
    with LogCopier(output, LogLayout(force=force), profile=profile_of(source)) as copier:
        done = _copy(source, copier, lost, progress)
        for name, facts in lost.records(always=True):
            copier.writer.add_metadata(name, facts)
    return Recovery(
        source=source,
        output=output,
        **done,
        damages=tuple(sorted(loss.damages)),
        damage_count=loss.count,
        messages_lost=loss.messages,
        expected_messages=expected,
        was_closed=closed,
        end_missing=not (closed or loss.ended),
        source_bytes=source_bytes,
        output_bytes=copier.writer.bytes_written,
    )


def _copy(source: Path, copier: LogCopier, lost: SourceLoss, progress: Progress) -> dict[str, int]:
    """Copies and counts what is intact."""
    done = {"messages": 0, "attachments": 0, "metadata": 0}
    identity: dict[str, str] = {}
    named: set[str] = set()
    for _, piece in progress(read_ahead(pieces_at(source, lost.loss))):
        if isinstance(piece, Attachment):
            copier.attach(piece)
            done["attachments"] += 1
            if piece.name == SETTINGS_ATTACHMENT:
                identity = identity_in(piece.data)
        elif isinstance(piece, Metadata):
            if lost.take(piece):
                continue
            copier.describe(piece)
            named.add(piece.name)
            done["metadata"] += 1
        elif not isinstance(piece, Header):
            lost.count(piece)
            done["messages"] += copier.copy_piece(piece)
    if identity and INFO_METADATA not in named:
        copier.writer.add_metadata(INFO_METADATA, identity)
        done["metadata"] += 1
    return done
