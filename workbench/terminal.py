"""Terminal output of commands: results on standard output, messages on standard error, progress on a
terminal only."""

from __future__ import annotations

import sys
import threading
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec
from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

T = TypeVar("T")
UNBROKEN_WORD_LENGTHS = (18, 12, 8, 4)
"""Word lengths that a table keeps unbroken; the first value that fits the terminal's width is used."""
COMPILING_MESSAGE = (
    "Still working. The first use on a machine compiles the search once, which takes up to half a minute."
)


def say(text: str) -> None:
    """Print a message on standard error. Markup in it is shown, never interpreted.

    If the reader has closed the pipe (2>&1 | head), the message is lost and the exit code does not change.
    """
    with suppress(BrokenPipeError):
        _Console(stderr=True, soft_wrap=True).print(escape(_as_text(text)), highlight=False)


def counted(number: int, thing: str) -> str:
    """ "1 container", "2 containers"."""
    return f"{number} {thing}" + ("" if number == 1 else "s")


def emit_json(answer: Any) -> None:
    """Print a result as one JSON document on standard output, keys in the given order.

    File names that are not valid UTF-8 are printed with replacement characters, since JSON cannot represent them.
    """
    try:
        document = msgspec.json.encode(answer)
    except UnicodeEncodeError:
        document = msgspec.json.encode(_as_text(msgspec.to_builtins(answer)))
    sys.stdout.buffer.write(msgspec.json.format(document, indent=2))
    sys.stdout.buffer.write(b"\n")
    sys.stdout.buffer.flush()


def emit_text(text: str) -> None:
    """Print a result as text on standard output."""
    sys.stdout.write(_as_text(text) + "\n")
    sys.stdout.flush()


def emit_table(rows: Sequence[Mapping[str, Any]], *, columns: Sequence[str] | None = None, title: str = "") -> None:
    """Print rows as a table on standard output; numbers right-aligned, missing values as a dash.

    On a narrow terminal, sentences wrap first, then the column separators are dropped, then long names are broken
    over several lines; nothing is truncated.
    """
    names = list(columns or (rows[0].keys() if rows else ()))
    console = _Console(file=sys.stdout)
    if not console.is_terminal:
        console = _Console(file=sys.stdout, width=max(120, 18 * len(names)))
    shown = [_Column.of(name, [row.get(name) for row in rows]) for name in names]
    console.print(_table(shown, title, console.width))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A formatted column and its minimum width."""

    heading: str
    cells: tuple[str, ...]
    numeric: bool

    @classmethod
    def of(cls, name: str, values: Sequence[Any]) -> _Column:
        numeric = any(isinstance(value, int | float) for value in values)
        return cls(heading=name.replace("_", " "), cells=tuple(map(_shown, values)), numeric=numeric)

    def least(self, longest: int) -> int:
        """The smallest width at which no number, and no word of up to `longest` characters, is broken."""
        heading = min(longest, _longest_word([self.heading]))
        inside = _longest_word(self.cells)
        return max(heading, inside if self.numeric else min(longest, inside), 1)


def _longest_word(texts: Iterable[str]) -> int:
    return max((cell_len(word) for text in texts for word in text.split()), default=0)


def _table(columns: Sequence[_Column], title: str, width: int) -> Table:
    """The first layout that fits the width: with column separators, without them, with broken words."""
    rules: box.Box | None = box.HEAVY_HEAD
    room, least = width - 3 * len(columns) - 1, [column.least(UNBROKEN_WORD_LENGTHS[0]) for column in columns]
    if sum(least) > room:
        rules, room = None, width - 2 * len(columns) + 2
        tries = ([column.least(longest) for column in columns] for longest in UNBROKEN_WORD_LENGTHS)
        least = next((some for some in tries if sum(some) <= room), [1] * len(columns))
    table = Table(title=title or None, title_justify="left", box=rules, pad_edge=rules is not None)
    for column, widest in zip(columns, _widths(columns, least, room), strict=True):
        justify = "right" if column.numeric else "left"
        table.add_column(escape(column.heading), justify=justify, overflow="fold", width=widest)
    for cells in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*map(escape, cells))
    return table


def _widths(columns: Sequence[_Column], least: Sequence[int], room: int) -> list[int]:
    """Column widths: the natural ones if they fit; otherwise the columns with most slack are narrowed first."""
    widths = [max(map(cell_len, (column.heading, *column.cells))) for column in columns]
    while sum(widths) > room:
        most = max(range(len(widths)), key=lambda i: widths[i] - least[i])
        if widths[most] <= least[most]:
            break
        widths[most] -= 1
    return widths


class _Console(Console):
    """A console that prints text literally (no emoji codes such as in `houses:-1`), and leaves a broken pipe to the
    command line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(emoji=False, **options)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def progress(items: Iterable[T], *, title: str, total: int | None = None) -> Iterator[T]:
    """Iterate over the items, with a progress bar if standard error is a terminal."""
    console = _Console(stderr=True)
    if not console.is_terminal:
        yield from items
        return
    from rich.progress import track

    yield from track(items, description=escape(title), total=total, console=console, transient=True)


@contextmanager
def patience(words: str = COMPILING_MESSAGE, *, after_s: float = 3.0) -> Generator[None]:
    """Print `words` if the body takes longer than `after_s` seconds and standard error is a terminal."""
    if not _Console(stderr=True).is_terminal:
        yield
        return
    timer = threading.Timer(after_s, say, (words,))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


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
