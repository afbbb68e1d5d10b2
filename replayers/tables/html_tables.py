"""Small HTML tables by which values show themselves in a notebook; every text in them is escaped.

They stand alone: no script, no style sheet, nothing loaded.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite

from markupsafe import Markup, escape

MAX_CELL_CHARS = 200
"""Characters of a cell; of longer ones the beginning is shown."""
MAX_ROWS = 40
"""Rows of a table; how many more there are is said below."""
TURNING = dict.fromkeys([*range(0x202A, 0x202F), *range(0x2066, 0x206A)], "\ufffd")
"""Controls that change the direction of all text after them."""

Cell = str | int | float | bool | None


def html_table(title: str, head: Sequence[str], rows: Iterable[Sequence[Cell]], *, note: str = "") -> str:
    """A table with a heading.

    Args:
        title: of the whole.
        head: of the columns; none leaves the row of headings out.
        rows: cells; numbers are rounded to one decimal and stand to the right, None is a dash.
        note: a line below.
    """
    listed = [tuple(row) for row in rows]
    top = Markup("").join(Markup('<th style="text-align:left">{}</th>').format(_text(name)) for name in head)
    body = Markup("").join(
        Markup("<tr>{}</tr>").format(Markup("").join(_cell(cell) for cell in row)) for row in listed[:MAX_ROWS]
    )
    more = f"and {len(listed) - MAX_ROWS} more rows" if len(listed) > MAX_ROWS else ""
    below = Markup("").join(Markup("<p>{}</p>").format(_text(line)) for line in (more, note) if line)
    heading = Markup("<thead><tr>{}</tr></thead>").format(top) if head else Markup("")
    return str(
        Markup("<div><p><b>{}</b></p><table>{}<tbody>{}</tbody></table>{}</div>").format(
            _text(title), heading, body, below
        )
    )


def _cell(value: Cell) -> Markup:
    if isinstance(value, float):
        shown = f"{value:.1f}" if isfinite(value) else "-"
    elif isinstance(value, bool):
        shown = "yes" if value else "no"
    else:
        shown = "-" if value is None else str(value)
    side = "right" if isinstance(value, int | float) and not isinstance(value, bool) else "left"
    return Markup('<td style="text-align:{}">{}</td>').format(side, _text(shown))


def _text(words: str) -> Markup:
    short = words if len(words) <= MAX_CELL_CHARS else words[: MAX_CELL_CHARS - 1] + "…"
    return escape(short.translate(TURNING))
