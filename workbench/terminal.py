"""How commands talk: data to standard output, words for people to standard error, progress on a terminal only."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeVar

import msgspec
from rich.console import Console
from rich.markup import escape
from rich.table import Table

T = TypeVar("T")


def say(text: str) -> None:
    """A line for people, on standard error. Markup in it is shown, never interpreted.

    Where nobody reads it any more (2>&1 | head) it is lost, and the exit code stays what it is.
    """
    with suppress(BrokenPipeError):
        _Console(stderr=True, soft_wrap=True).print(escape(_as_text(text)), highlight=False)


def counted(number: int, thing: str) -> str:
    """ "1 container", "2 containers"."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def emit_json(answer: Any) -> None:
    """A machine's answer, on standard output: one JSON document, keys in the order given.

    Names of files that are no UTF-8 are shown with a replacement character, as JSON has no other way.
    """
    try:
        document = msgspec.json.encode(answer)
    except UnicodeEncodeError:
        document = msgspec.json.encode(_as_text(msgspec.to_builtins(answer)))
    sys.stdout.buffer.write(msgspec.json.format(document, indent=2))
    sys.stdout.buffer.write(b"\n")
    sys.stdout.buffer.flush()


def emit_text(text: str) -> None:
    """A person's answer, on standard output."""
    sys.stdout.write(_as_text(text) + "\n")
    sys.stdout.flush()


def emit_table(rows: Sequence[Mapping[str, Any]], *, columns: Sequence[str] | None = None, title: str = "") -> None:
    """Rows as a table on standard output; numbers to the right, missing values as a dash."""
    names = list(columns or (rows[0].keys() if rows else ()))
    table = Table(title=title or None, title_justify="left")
    for name in names:
        numeric = any(isinstance(row.get(name), int | float) for row in rows)
        table.add_column(escape(name.replace("_", " ")), justify="right" if numeric else "left")
    for row in rows:
        table.add_row(*(escape(_shown(row.get(name))) for name in names))
    console = _Console(file=sys.stdout)
    if not console.is_terminal:
        console = _Console(file=sys.stdout, width=max(120, 18 * len(names)))
    console.print(table)


class _Console(Console):
    """A console that shows what it is given (houses:-1 is no thumb), and leaves it to the command line what a
    reader that is gone means."""

    def __init__(self, **options: Any) -> None:
        super().__init__(emoji=False, **options)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def progress(items: Iterable[T], *, title: str, total: int | None = None) -> Iterator[T]:
    """The items again, with a progress bar on standard error when that is a terminal."""
    console = _Console(stderr=True)
    if not console.is_terminal:
        yield from items
        return
    from rich.progress import track

    yield from track(items, description=escape(title), total=total, console=console, transient=True)


def _as_text(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    if isinstance(value, Mapping):
        return {_as_text(key): _as_text(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_as_text(part) for part in value]
    return value


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 10_000 else f"{value:.3g}" if abs(value) < 1 else f"{value:.2f}"
    return _as_text(str(value))
