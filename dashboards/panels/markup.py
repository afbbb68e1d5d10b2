"""Safe HTML for panels: text is escaped, numbers are rounded for people, clicks carry a plain command.

A clickable thing carries `data-lios="seek 12.5"`; the page that shows it decides what to do with the command.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from types import MappingProxyType
from typing import LiteralString

from markupsafe import Markup, escape

from dashboards.palette import Colour, css
from dashboards.resources import resource
from workbench.worlds.names import readable_name

TURNING = dict.fromkeys([*range(0x202A, 0x202F), *range(0x2066, 0x206A)], "\ufffd")
"""Controls that change the direction of all text after them (Unicode's bidirectional embeddings and overrides)."""
LARGE = 1e6
MAX_NAME_CHARS = 80
"""Characters of a name that are shown; its tooltip has the whole."""


def text(value: object) -> Markup:
    """Any value as escaped text, which never runs as markup and cannot change the direction of other text."""
    return escape(str(value).translate(TURNING))


def html(template: LiteralString, *parts: object) -> Markup:
    """Markup of a template that stands in the code, with {} for each part; what is no Markup is taken as text.

    Panels are made of nothing else, so that no name of a log can become markup.
    """
    shown = [text(part) if isinstance(part, str) and not isinstance(part, Markup) else part for part in parts]
    return Markup(template).format(*shown)


def name(value: object, *, max_chars: int = MAX_NAME_CHARS) -> Markup:
    """A name, shortened if very long, with the whole as a tooltip."""
    whole = str(value)
    if len(whole) <= max_chars:
        return text(whole)
    return html('<span title="{}">{}…</span>', text(whole), text(whole[: max_chars - 1]))


def breakable(value: str) -> Markup:
    """As `name`, with breaks allowed where a file's name has its joints, so that a narrow table need not be cut."""
    if len(value) > MAX_NAME_CHARS:
        return name(value)
    return Markup(re.sub(r"(?<=[_:/.])", Markup("<wbr>"), text(value)))


def place(location: str) -> Markup:
    """As `place_words`, with a small number; the id is in the tooltip."""
    kind, bar, rest = location.partition("|")
    if not bar:
        return name(readable_name(location))
    which = html("<small>{}</small>", text(rest[:MAX_NAME_CHARS]))
    return html('<span title="{}">{} {}</span>', text(location), name(readable_name(kind)), which)


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


def command(words: str) -> Markup:
    """The attributes of something that can be clicked."""
    return html('data-lios="{}" role="button" tabindex="0"', text(words))


def chip(label: str, colour: str, *, dark: bool = False) -> Markup:
    ink = "#fff" if dark else "#1c1e21"
    return html('<span class="chip" style="background:{};color:{}">{}</span>', text(colour), ink, text(label))


def dot(colour: Colour) -> Markup:
    return html('<span class="dot" style="background:{}"></span>', css(colour))


def bar(share: float, colour: str) -> Markup:
    """A horizontal bar that fills a fraction of its cell."""
    width = 0.0 if share != share else 100 * min(max(share, 0.0), 1.0)
    return html('<div class="bar"><div style="width:{:.1f}%;background:{}"></div></div>', width, text(colour))


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    key: str = "",
    classes: Sequence[str] = (),
    hints: Mapping[str, str] = MappingProxyType({}),
    commands: Mapping[str, str] = MappingProxyType({}),
    headings: Mapping[int, Markup] = MappingProxyType({}),
) -> Markup:
    """A table of cells that are already markup; a click on a heading sorts by it.

    Args:
        key: name of the table, so that a chosen sort order survives new content.
        classes: one per column ("n" for numbers).
        hints: what a heading means, shown as its tooltip.
        commands: what a click on a heading asks for, where the page itself does not sort.
        headings: markup that stands in a line of its own before a row, by the row's number.
    """
    kinds = [*classes, *[""] * len(head)]
    top = Markup("").join(
        html(
            '<th class="{}" {}{}>{}</th>',
            kinds[i],
            command(commands.get(title, f"sort {key} {i}")),
            _tooltip(hints.get(title)),
            text(title),
        )
        for i, title in enumerate(head)
    )
    body = Markup("").join(
        _heading(headings.get(number), len(head))
        + Markup("<tr>")
        + Markup("").join(html('<td class="{}">{}</td>', kinds[i], cell) for i, cell in enumerate(row))
        + Markup("</tr>")
        for number, row in enumerate(rows)
    )
    return html(
        '<table class="lios" data-table="{}"><thead><tr>{}</tr></thead><tbody>{}</tbody></table>',
        text(key),
        top,
        body,
    )


def _heading(words: Markup | None, columns: int) -> Markup:
    return html('<tr class="group"><td colspan="{}">{}</td></tr>', columns, words) if words else Markup("")


def _tooltip(hint: str | None) -> Markup:
    return html(' title="{}"', text(hint)) if hint else Markup("")


def error_line(line: str) -> Markup:
    """An error in one line; nothing for an empty text."""
    return html('<div class="lp"><p class="trouble">{}</p></div>', name(line, max_chars=400)) if line else Markup("")


def style() -> Markup:
    """The style sheet that all panels share."""
    return html("<style>{}</style>", Markup(resource("panels/panels.css")))
