"""Panel of a place's memory: on each day, where each kind of item was seen, and where it was gone."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime

from markupsafe import Markup

from dashboards.panels.markup import html, name, place, table
from workbench.beliefs.memory.history import History
from workbench.beliefs.memory.move_rates import NS_PER_DAY
from workbench.worlds.names import readable_name

MAX_DAYS, MAX_ITEMS, MAX_PLACES = 8, 200, 6
"""The newest days, the first item types, and the first places in a cell; what is left out is counted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DayOfItem:
    """One kind of item on one day: the containers that held it when last looked into, and those that did no more."""

    seen: tuple[str, ...] = ()
    gone: tuple[str, ...] = ()


def days_of_items(history: History) -> dict[str, dict[int, DayOfItem]]:
    """For each item type, sorted, its days (since the Unix epoch, UTC) on which something was learned of it."""
    made: dict[str, dict[int, DayOfItem]] = {}
    holders: dict[str, set[str]] = {}
    by_day: dict[int, dict[str, tuple[str, ...]]] = {}
    for look in history.looks:
        by_day.setdefault(look.seen_ns // NS_PER_DAY, {})[look.container] = tuple(look.item_types)
    for day, held in sorted(by_day.items()):
        for item_type in sorted({t for types in held.values() for t in types} | holders.keys()):
            before = holders.get(item_type, set[str]())
            seen = {c for c, types in held.items() if item_type in types}
            gone = {c for c in before if c in held} - seen
            if seen or gone:
                there = DayOfItem(seen=tuple(sorted(seen)), gone=tuple(sorted(gone)))
                made.setdefault(item_type, {})[day] = there
            holders[item_type] = (before | seen) - gone
    return dict(sorted(made.items()))


def memory(history: History) -> Markup:
    """A table of item types by days."""
    found = days_of_items(history)
    days = sorted({day for of_item in found.values() for day in of_item})
    shown, items = days[-MAX_DAYS:], list(found.items())
    rows = [
        [name(readable_name(item_type)), *(_cell(of_item.get(day)) for day in shown)]
        for item_type, of_item in items[:MAX_ITEMS]
    ]
    left_out = [
        *([f"{len(days) - len(shown)} earlier days"] if len(days) > len(shown) else []),
        *([f"{len(items) - MAX_ITEMS} more kinds of items"] if len(items) > MAX_ITEMS else []),
    ]
    more = html('<p class="muted">Left out: {}.</p>', " and ".join(left_out)) if left_out else Markup("")
    intro = html(
        '<p class="muted">{} runs in {}: where each kind of item was seen; struck through where it was gone.</p>',
        len(history.runs),
        name(history.plan.name),
    )
    return html('<div class="lp">{}{}{}</div>', intro, table(("item", *map(_date, shown)), rows, key="memory"), more)


def _cell(day: DayOfItem | None) -> Markup:
    if day is None:
        return Markup("")
    there = [place(container) for container in day.seen[:MAX_PLACES]]
    gone = [html("<s>{}</s>", place(container)) for container in day.gone[:MAX_PLACES]]
    rest = max(0, len(day.seen) - MAX_PLACES) + max(0, len(day.gone) - MAX_PLACES)
    return _lines([*there, *gone, *([html("and {} more", rest)] if rest else [])])


def _lines(parts: Iterable[Markup]) -> Markup:
    return Markup("<br>").join(parts)


def _date(day: int) -> str:
    """ "01-31" of a day since the Unix epoch; the day's number where no calendar has it."""
    try:
        return datetime.fromtimestamp(day * 86_400, tz=UTC).strftime("%m-%d")
    except (ValueError, OverflowError, OSError):
        return f"day {day}"
