"""Bags in SQLite (.db3), read by Python's own module from the files alone, without metadata.yaml.

A file whose recorder was killed is read with its journal or write-ahead log, from a copy, so that nothing is changed.
"""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from heapq import merge
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

from replayers.importers.message_types import Definition, MessageTypes, Raw, SurveyedBag, TypeFinding, full_name
from replayers.mcap_io.records import MAX_RECORD_BYTES

JOURNALS = ("-wal", "-journal")
"""Endings of what SQLite leaves beside a file that was not closed."""


@final
@dataclass(slots=True, kw_only=True)
class SqliteFiles(SurveyedBag):
    """SQLite files of one bag; opened by `open_sqlite`, used inside its stack.

    Attributes:
        undefined: types without a definition, by topic.
    """

    databases: list[sqlite3.Connection]
    undefined: dict[str, str] = field(default_factory=dict)

    def survey(self) -> None:
        """Reads topics, counts and the start."""
        firsts: list[int] = []
        for database in self.databases:
            for number, topic, definition in _topics_of(database):
                found = self.types.learn(definition)
                query = "SELECT count(*), min(timestamp) FROM messages WHERE topic_id = ?"
                ((count, first),) = database.execute(query, (number,)).fetchall()
                if found.kind is TypeFinding.UNDEFINED:
                    self.undefined[topic] = definition.kind
                if found.kind is not TypeFinding.KNOWN:
                    self.skipped.setdefault(topic, found.message)
                elif count:
                    self.counts[topic] = self.counts.get(topic, 0) + count
                    firsts.append(int(first))
        self.start_ns = min(firsts, default=0)

    def raw(self, topics: tuple[str, ...]) -> Iterator[Raw]:
        """Undecoded messages of some topics in the order of their time, of all files together."""
        wanted = frozenset(topics) - self.skipped.keys()
        streams = [self._ordered(database, wanted) for database in self.databases]
        yield from merge(*streams, key=lambda each: each[0])

    def _ordered(self, database: sqlite3.Connection, topics: frozenset[str]) -> Iterator[Raw]:
        chosen = {number: (topic, kind) for number, topic, kind in _topics_of(database) if topic in topics}
        places = ", ".join("?" * len(chosen))
        query = f"SELECT timestamp, topic_id, data FROM messages WHERE topic_id IN ({places}) ORDER BY timestamp, id"
        for stamp_ns, number, data in database.execute(query, tuple(chosen)):
            yield int(stamp_ns), *chosen[number], bytes(data)


def open_sqlite(paths: tuple[Path, ...], types: MessageTypes, stack: ExitStack) -> SqliteFiles:
    """The files of a bag, surveyed; open until the stack ends.

    Raises:
        OSError, ValueError: a file is no SQLite bag, or damaged.
    """
    databases = [_opened(path, stack) for path in paths]
    files = SqliteFiles(databases=databases, types=types)
    try:
        files.survey()
    except (sqlite3.Error, TypeError) as error:
        raise ValueError(f"{error}; a damaged SQLite file may be saved by sqlite3 FILE .recover") from error
    return files


def _opened(path: Path, stack: ExitStack) -> sqlite3.Connection:
    beside = [own for ending in JOURNALS if (own := path.with_name(path.name + ending)).is_file()]
    if any(own.stat().st_size for own in beside):
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="lios-import-")))
        for own in (path, *beside):
            shutil.copyfile(own, folder / own.name)
        address = f"{(folder / path.name).as_uri()}?mode=rw"
    else:
        address = f"{path.resolve().as_uri()}?mode=ro&immutable=1"
    try:
        database = stack.enter_context(closing(sqlite3.connect(address, uri=True)))
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD_BYTES)
        database.execute("PRAGMA trusted_schema = OFF")
        tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    except sqlite3.Error as error:
        raise ValueError(f"{path.name}: {error}") from error
    if not {"topics", "messages"} <= tables:
        raise ValueError(f"{path.name} has no tables of topics and messages")
    return database


def _topics_of(database: sqlite3.Connection) -> list[tuple[int, str, Definition]]:
    """Number, name and type of each topic."""
    texts = _definitions_in(database)
    query = "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
    found: list[tuple[int, str, Definition]] = []
    for number, topic, kind, encoding in database.execute(query).fetchall():
        schema_encoding, text = texts.get(kind, ("", b""))
        known = Definition(kind=full_name(kind), encoding=encoding, schema_encoding=schema_encoding, text=text)
        found.append((number, topic, known))
    return found


def _definitions_in(database: sqlite3.Connection) -> dict[str, tuple[str, bytes]]:
    """Encoding and text of the definitions by type; none in files of older releases."""
    if not database.execute("PRAGMA table_info(message_definitions)").fetchall():
        return {}
    query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
    return {kind: (encoding, text.encode()) for kind, encoding, text in database.execute(query) if text}
