"""Safe HTML for panels: text is escaped, numbers are rounded for people, clicks carry a plain command.

A clickable thing carries `data-lios="seek 12.5"`; the page that shows it decides what to do with the command.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite

from dashboards.palette import Colour, css
from dashboards.resources import resource
from workbench.worlds.names import readable_name

TURNING = dict.fromkeys([*range(0x202A, 0x202F), *range(0x2066, 0x206A)], "\ufffd")
"""Controls that change the direction of all text after them (Unicode's bidirectional embeddings and overrides)."""
LARGE = 1e6
MAX_NAME_CHARS = 80
"""Characters of a name that are shown; its tooltip has the whole."""


def text(value: object) -> str:
    """Any value as escaped text, which never runs as markup and cannot change the direction of other text."""
    return escape(str(value).translate(TURNING), quote=True)


def name(value: object, *, most: int = MAX_NAME_CHARS) -> str:
    """A name, shortened if very long, with the whole as a tooltip."""
    whole = str(value)
    if len(whole) <= most:
        return text(whole)
    return f'<span title="{text(whole)}">{text(whole[: most - 1])}…</span>'


def breakable(value: str) -> str:
    """As `name`, with breaks allowed where a file's name has its joints, so that a narrow table need not be cut."""
    return re.sub(r"(?<=[_:/.])", "<wbr>", text(value)) if len(value) <= MAX_NAME_CHARS else name(value)


def place(location: str) -> str:
    """As `place_words`, with a small number; the id is in the tooltip."""
    kind, bar, rest = location.partition("|")
    if not bar:
        return name(readable_name(location))
    which = f"<small>{text(rest[:MAX_NAME_CHARS])}</small>"
    return f'<span title="{text(location)}">{name(readable_name(kind))} {which}</span>'


def number(value: float | None, digits: int = 1) -> str:
    """A number for people; a dash for None. Very large ones are in scientific notation: 3.50e12."""
    if value is None or value != value:
        return "–"
    if isfinite(value) and abs(value) >= LARGE:
        mantissa, _, power = f"{value:.2e}".partition("e")
        return f"{mantissa}e{int(power)}"
    return f"{value:.{digits}f}"


def axis_number(value: float, top: float) -> str:
    """A number at an axis that ends at top, with enough digits to distinguish the ticks."""
    return number(value, 0 if top >= 10 else 1 if top >= 1 else 2)


def percent(value: float | None) -> str:
    if value is None or value != value:
        return "–"
    return f"{100 * value:.1f} %" if value < 0.1 else f"{100 * value:.0f} %"


def command(words: str) -> str:
    """The attributes of something that can be clicked."""
    return f'data-lios="{text(words)}" role="button" tabindex="0"'


def chip(label: str, colour: str, *, dark: bool = False) -> str:
    ink = "#fff" if dark else "#1c1e21"
    return f'<span class="chip" style="background:{text(colour)};color:{ink}">{text(label)}</span>'


def dot(colour: Colour) -> str:
    return f'<span class="dot" style="background:{css(colour)}"></span>'


def bar(share: float, colour: str) -> str:
    """A horizontal bar that fills a fraction of its cell."""
    width = 0.0 if share != share else 100 * min(max(share, 0.0), 1.0)
    return f'<div class="bar"><div style="width:{width:.1f}%;background:{text(colour)}"></div></div>'


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, key: str = "", classes: Sequence[str] = ()) -> str:
    """A table of cells that are already markup; a click on a heading sorts by it.

    Args:
        key: name of the table, so that a chosen sort order survives new content.
        classes: one per column ("n" for numbers).
    """
    kinds = [*classes, *[""] * len(head)]
    top = "".join(
        f'<th class="{kinds[i]}" {command(f"sort {key} {i}")}>{text(title)}</th>' for i, title in enumerate(head)
    )
    body = "".join(
        "<tr>" + "".join(f'<td class="{kinds[i]}">{cell}</td>' for i, cell in enumerate(row)) + "</tr>"
        for row in rows
    )
    return f'<table class="lios" data-table="{text(key)}"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>'


def error_line(line: str) -> str:
    """An error in one line; nothing for an empty text."""
    return f'<div class="lp"><p class="trouble">{name(line, most=400)}</p></div>' if line else ""


def style() -> str:
    """The style sheet that all panels share."""
    return f"<style>{resource('panels/panels.css')}</style>"
