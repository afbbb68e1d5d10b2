"""Tables on a terminal and in pipes, and the console that prints them, by rich."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

UNBROKEN_WORD_LENGTHS = (18, 12, 8, 4)
"""On a terminal too narrow for two columns: word lengths that a table keeps unbroken; the first that fits is used."""
MIN_COLUMNS = 2
"""What a table of a narrow terminal keeps, however long its words."""


class PlainConsole(Console):
    """A console that prints text literally (no emoji codes such as in `houses:-1`), and leaves a broken pipe to the
    command line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(emoji=False, **options)

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedColumn:
    """A column as text.

    Attributes:
        numeric: right-aligned, and never broken.
    """

    heading: str
    cells: tuple[str, ...]
    numeric: bool

    def least(self, *, breaks_paths: bool, longest: int | None = None) -> int:
        """The smallest width at which no number and no name is broken.

        Args:
            longest: words longer than this may be broken; None for none but paths, after a slash.
        """
        heading = _longest_word([self.heading], paths=True)
        inside = _longest_word(self.cells, paths=not breaks_paths)
        if longest is not None and not self.numeric:
            inside = min(longest, inside)
        return max(heading if longest is None else min(longest, heading), inside, 1)


def print_table(
    columns: Sequence[PrintedColumn], *, title: str, first_out: Iterable[PrintedColumn], keep_all: bool
) -> tuple[PrintedColumn, ...]:
    """Print a table on standard output, without the columns for which a terminal has no space.

    Args:
        first_out: columns that are left out first, in this order; then those farthest to the right.

    Returns:
        The columns that were left out.
    """
    console = PlainConsole(file=sys.stdout)
    breaks_paths = console.is_terminal
    if not console.is_terminal:
        unbroken = sum(column.least(breaks_paths=False) for column in columns) + 3 * len(columns) + 1
        console = PlainConsole(file=sys.stdout, width=max(120, 18 * len(columns), unbroken))
    kept, out = list(columns), list(first_out)
    while len(kept) > MIN_COLUMNS and not keep_all and not _fits(kept, console.width, breaks_paths=breaks_paths):
        kept.remove(out.pop(0) if out else kept[-1])
    if title:  # a title of rich's own table would be padded with blanks to the table's width
        console.print(escape(title), style="italic", highlight=False, soft_wrap=not console.is_terminal)
    console.print(_table(kept, console.width, breaks_paths=breaks_paths))
    return tuple(column for column in columns if column not in kept)


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


def _fits(columns: Sequence[PrintedColumn], width: int, *, breaks_paths: bool) -> bool:
    """Whether a table without column separators fits with no name broken."""
    return sum(column.least(breaks_paths=breaks_paths) for column in columns) <= width - 2 * len(columns) + 2


def _table(columns: Sequence[PrintedColumn], width: int, *, breaks_paths: bool) -> Table:
    """The first layout that fits the width: with column separators, without them, with broken words."""
    rules: box.Box | None = box.HEAVY_HEAD
    room, least = width - 3 * len(columns) - 1, [column.least(breaks_paths=breaks_paths) for column in columns]
    if sum(least) > room:
        rules, room = None, width - 2 * len(columns) + 2
        lengths = (None, *UNBROKEN_WORD_LENGTHS)
        tries = ([c.least(breaks_paths=breaks_paths, longest=longest) for c in columns] for longest in lengths)
        least = next((some for some in tries if sum(some) <= room), [1] * len(columns))
    widths = _widths(columns, least, room)
    table = Table(box=rules, pad_edge=rules is not None)
    for column, widest in zip(columns, widths, strict=True):
        justify = "right" if column.numeric else "left"
        table.add_column(escape(column.heading), justify=justify, overflow="fold", width=widest)
    for cells in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*(escape(_broken_at_slashes(c, widest)) for c, widest in zip(cells, widths, strict=True)))
    return table


def _widths(columns: Sequence[PrintedColumn], least: Sequence[int], room: int) -> list[int]:
    """Column widths: the natural ones if they fit; otherwise the columns with most slack are narrowed first."""
    widths = [max(map(cell_len, (column.heading, *column.cells))) for column in columns]
    while sum(widths) > room:
        most = max(range(len(widths)), key=lambda i: widths[i] - least[i])
        if widths[most] <= least[most]:
            break
        widths[most] -= 1
    return widths
