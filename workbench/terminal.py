"""Terminal output of commands: results on standard output, messages on standard error, progress on a
terminal only."""

from __future__ import annotations

import re
import sys
import threading
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, TypeVar

import msgspec
from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

T = TypeVar("T")
_wide: ContextVar[bool] = ContextVar("wide", default=False)
UNBROKEN_WORD_LENGTHS = (18, 12, 8, 4)
"""On a terminal too narrow for two columns: word lengths that a table keeps unbroken; the first that fits is used."""
MIN_COLUMNS = 2
"""What a table of a narrow terminal keeps, however long its words."""
WIDE = "--wide"
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


@contextmanager
def wide_tables() -> Generator[None]:
    """Meanwhile tables leave no column out, however narrow the terminal."""
    token = _wide.set(True)
    try:
        yield
    finally:
        _wide.reset(token)


def emit_table(
    rows: Sequence[Mapping[str, Any]],
    *,
    columns: Sequence[str] | None = None,
    title: str = "",
    minor: Sequence[str] = (),
) -> None:
    """Print rows as a table on standard output; numbers right-aligned, missing values as a dash.

    On a narrow terminal, sentences wrap first, then the column separators are dropped, then columns are left out; a
    line on standard error names them, and --wide shows them. Names and numbers are not broken; paths only after a
    slash. In a pipe or file, nothing is left out.

    Args:
        minor: columns that are left out first, in this order; then those farthest to the right.
    """
    names = list(columns or (rows[0].keys() if rows else ()))
    console = _Console(file=sys.stdout)
    breaks = console.is_terminal
    shown = [_Column.of(name, [row.get(name) for row in rows], breaks_paths=breaks) for name in names]
    if not console.is_terminal:
        unbroken = sum(column.least() for column in shown) + 3 * len(shown) + 1
        console = _Console(file=sys.stdout, width=max(120, 18 * len(names), unbroken))
    kept, first_out = list(shown), [shown[names.index(name)] for name in minor if name in names]
    while len(kept) > MIN_COLUMNS and not _wide.get() and not _fits(kept, console.width):
        kept.remove(first_out.pop(0) if first_out else kept[-1])
    if title:  # a title of rich's own table would be padded with blanks to the table's width
        console.print(escape(_as_text(title)), style="italic", highlight=False, soft_wrap=not console.is_terminal)
    console.print(_table(kept, console.width))
    if len(kept) < len(shown):
        left_out = ", ".join(column.heading for column in shown if column not in kept)
        say(f"Not shown, for lack of space: {left_out}. {WIDE} shows every column.")


def signed_percentage(share: float | None) -> str | None:
    """ "+13.7 %" for 0.137; None for None."""
    return None if share is None else f"{100 * share:+.1f} %"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A formatted column and its minimum width."""

    heading: str
    cells: tuple[str, ...]
    numeric: bool
    breaks_paths: bool

    @classmethod
    def of(cls, name: str, values: Sequence[Any], *, breaks_paths: bool) -> _Column:
        numeric = any(isinstance(value, int | float) or _is_percentage(value) for value in values)
        return cls(
            heading=name.replace("_", " "),
            cells=tuple(map(_shown, values)),
            numeric=numeric,
            breaks_paths=breaks_paths,
        )

    def least(self, longest: int | None = None) -> int:
        """The smallest width at which no number and no name is broken.

        Args:
            longest: words longer than this may be broken; None for none but paths, after a slash.
        """
        heading = _longest_word([self.heading], paths=True)
        inside = _longest_word(self.cells, paths=not self.breaks_paths)
        if longest is not None and not self.numeric:
            inside = min(longest, inside)
        return max(heading if longest is None else min(longest, heading), inside, 1)


def _is_percentage(value: object) -> bool:
    return isinstance(value, str) and re.fullmatch(r"[+-]?\d+(\.\d+)? %", value) is not None


def _longest_word(texts: Iterable[str], *, paths: bool) -> int:
    """The length of the longest word; where paths are not kept whole, of the longest piece of a word."""
    words = (word for text in texts for word in text.split())
    return max((cell_len(piece) for word in words for piece in ([word] if paths else _pieces(word))), default=0)


def _pieces(word: str) -> list[str]:
    """What a word may be broken into: a path after each slash, any other word not at all."""
    return re.findall(r"[^/]*/|[^/]+", word)


def _broken_at_slashes(cell: str, width: int) -> str:
    """The cell, with a line break after a slash wherever a path is longer than the column."""
    if "/" not in cell or max(map(cell_len, cell.split()), default=0) <= width:
        return cell
    words: list[str] = []
    for word in cell.split(" "):
        lines = [""]
        for piece in _pieces(word):
            if lines[-1] and cell_len(lines[-1]) + cell_len(piece) > width:
                lines.append("")
            lines[-1] += piece
        words.append("\n".join(lines))
    return " ".join(words)


def _fits(columns: Sequence[_Column], width: int) -> bool:
    """Whether a table without column separators fits with no name broken."""
    return sum(column.least() for column in columns) <= width - 2 * len(columns) + 2


def _table(columns: Sequence[_Column], width: int) -> Table:
    """The first layout that fits the width: with column separators, without them, with broken words."""
    rules: box.Box | None = box.HEAVY_HEAD
    room, least = width - 3 * len(columns) - 1, [column.least() for column in columns]
    if sum(least) > room:
        rules, room = None, width - 2 * len(columns) + 2
        tries = ([column.least(longest) for column in columns] for longest in (None, *UNBROKEN_WORD_LENGTHS))
        least = next((some for some in tries if sum(some) <= room), [1] * len(columns))
    widths = _widths(columns, least, room)
    table = Table(box=rules, pad_edge=rules is not None)
    for column, widest in zip(columns, widths, strict=True):
        justify = "right" if column.numeric else "left"
        table.add_column(escape(column.heading), justify=justify, overflow="fold", width=widest)
    for cells in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*(escape(_broken_at_slashes(c, widest)) for c, widest in zip(cells, widths, strict=True)))
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
