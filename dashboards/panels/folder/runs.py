"""Panel of the runs in a folder: a table with filters, order, groups and pages; a click opens or overlays a run."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from types import MappingProxyType

from markupsafe import Markup

from dashboards.panels.markup import breakable, command, html, name, number, table, text


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """One log in the table.

    Attributes:
        cost: None where it is not known. bounds: the least and the greatest cost of a replay that its log cannot
            settle, in the unit of cost; None where they were not proven, or the cost is known.
        replay_of: the log that a kept replay is of; "" for other runs, and where that is not known.
    """

    index: int
    file: str
    place: str
    scenario: str
    strategy: str
    seed: int
    source: str
    outcome: str
    cost: float | None
    searches: int | None
    estimator: str = ""
    bounds: tuple[float, float] | None = None
    replay_of: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunsOrder:
    """How the table is arranged.

    Attributes:
        column: a key of COLUMNS; "" leaves the rows as they are. group: a key of GROUPS; "" for none.
        page: from 0.
    """

    column: str = ""
    descending: bool = False
    group: str = ""
    page: int = 0


PAGE_ROWS = 200
UNBROKEN_CHARS = 10
"""Characters of a scenario that stay in one line."""
MAX_SCENARIO_CHARS = 24
MAX_PROBLEMS, MAX_PROBLEM_CHARS = 20, 300
"""Logs left out that are named, and characters of each reason."""
COLUMNS: Mapping[str, Callable[[RunRow], str | float | None]] = MappingProxyType(
    {
        "strategy": lambda row: row.strategy,
        "cost": lambda row: row.cost,
        "outcome": lambda row: row.outcome,
        "looks": lambda row: row.searches,
        "scenario": lambda row: row.scenario,
        "place": lambda row: row.place,
        "seed": lambda row: row.seed,
        "file": lambda row: row.file,
    }
)
"""What rows can be ordered by. All but BELOW are columns: those first by which runs are compared."""
SMALL_TYPE_FIELDS = ("place", "seed", "file")
"""What stands in small type below the strategy, so that the table need not be wider than its panel."""
HINTS = {"cost": "The charged cost; the bounds of a replay whose cost its log cannot settle", "looks": "Searches"}
GROUPS: Mapping[str, Callable[[RunRow], str]] = MappingProxyType(
    {
        "place": lambda row: row.place,
        "scenario": lambda row: row.scenario,
        "strategy": lambda row: row.strategy,
        "estimator": lambda row: row.estimator,
        "seed": lambda row: str(row.seed),
        "outcome": lambda row: row.outcome,
        "source": lambda row: row.source,
    }
)
"""What rows can be grouped by, and what "scenario=breakfast" in the filter compares."""
KINDS = ("", "", "n", "", "n", "")


def runs(rows: Sequence[RunRow], shown: tuple[int, ...], *, total: int, order: RunsOrder | None = None) -> Markup:
    """One page of the rows that pass the filters; those on show are marked."""
    if not rows:
        return html('<div class="lp"><p class="muted">None of {} runs passes the filters.</p></div>', total)
    order = order or RunsOrder()
    arranged = ordered(rows, order)
    page = min(order.page, (len(arranged) - 1) // PAGE_ROWS)
    first = page * PAGE_ROWS
    here = arranged[first : first + PAGE_ROWS]
    titles = {title: title + _arrow(title, order) for title in COLUMNS if title not in SMALL_TYPE_FIELDS}
    commands = {shown_as: f"order {title}" for title, shown_as in titles.items()}
    hints = {shown_as: HINTS[title] for title, shown_as in titles.items() if title in HINTS}
    made = table(
        ("", *titles.values()),
        [_cells(row, shown) for row in here],
        key="runs",
        classes=KINDS,
        hints=hints,
        commands=commands,
        headings=_headings(arranged, here, order.group),
    )
    below = Markup(", ").join(
        html('<span class="seek" {}>{}</span>', command(f"order {title}"), title + _arrow(title, order))
        for title in SMALL_TYPE_FIELDS
    )
    count = html(
        '<p class="muted">{} of {} runs. A name opens a run; + overlays it. Order also by {}.</p>',
        len(rows),
        total,
        below,
    )
    pages = _pages(page, len(arranged))
    return html('<div class="lp">{}{}{}{}</div>', count, pages, made, pages)


def _arrow(title: str, order: RunsOrder) -> str:
    return "" if title != order.column else " ▼" if order.descending else " ▲"


def left_out(problems: Sequence[str]) -> Markup:
    """The logs of a folder that cannot be shown, and why."""
    if not problems:
        return Markup("")
    lines = Markup("").join(
        html("<p>{}</p>", name(problem, max_chars=MAX_PROBLEM_CHARS)) for problem in problems[:MAX_PROBLEMS]
    )
    more = html("<p>and {} more</p>", len(problems) - MAX_PROBLEMS) if len(problems) > MAX_PROBLEMS else Markup("")
    return html(
        '<div class="lp"><div class="warn"><b>{} logs left out</b>{}{}</div></div>', len(problems), lines, more
    )


def ordered(rows: Sequence[RunRow], order: RunsOrder) -> list[RunRow]:
    """The rows by group, and within each by the column; those without a value come last."""
    arranged = list(rows)
    value = COLUMNS.get(order.column)
    if value is not None:
        known = [row for row in arranged if value(row) is not None]
        known.sort(key=lambda row: _sortable(value(row)), reverse=order.descending)
        arranged = known + [row for row in arranged if value(row) is None]
    group = GROUPS.get(order.group)
    return sorted(arranged, key=group) if group is not None else arranged


def passes(row: RunRow, words: str) -> bool:
    """Whether every word occurs in the row; "cost<50" and "cost>50" compare, "strategy=lios" asks for the whole."""
    words_of = (row.file, row.place, row.scenario, row.strategy, row.source, row.outcome, row.replay_of)
    haystack = " ".join(words_of).lower()
    return all(_passes(row, word, haystack) for word in _words(words.lower()))


@lru_cache(maxsize=64)
def _words(words: str) -> Sequence[str]:
    """Words, of which those in quotation marks may hold spaces."""
    try:
        return tuple(shlex.split(words))
    except ValueError:  # a quotation mark that is not closed yet
        return words.replace('"', " ").replace("'", " ").split()


def _passes(row: RunRow, word: str, haystack: str) -> bool:
    key, equals, wanted = word.partition("=")
    if word.startswith(("cost<", "cost>")):
        try:
            bound = float(word[5:])
        except ValueError:
            return True
        return row.cost is not None and (row.cost < bound if word[4] == "<" else row.cost > bound)
    if equals and key in GROUPS:
        return not wanted or GROUPS[key](row).lower() == wanted
    return word in haystack


def _sortable(value: str | float | None) -> tuple[str, float]:
    return (value.lower(), 0.0) if isinstance(value, str) else ("", float(value or 0.0))


def _cells(row: RunRow, shown: tuple[int, ...]) -> list[str]:
    replayed = Markup("")
    if row.source == "replay":
        of = html(" of {}", breakable(row.replay_of)) if row.replay_of else ""
        replayed = html(' <span class="muted">replay{}</span>', of)
    below = html("<br><small>{} · seed {} · {}</small>", breakable(row.place), row.seed, breakable(row.file))
    return [
        _mark(row.index, shown),
        _opened_by(row) + replayed + below,
        _cost(row),
        name(row.outcome),
        "–" if row.searches is None else str(row.searches),
        _unbroken(name(row.scenario, max_chars=MAX_SCENARIO_CHARS)),
    ]


def _cost(row: RunRow) -> Markup:
    if row.cost is None and row.bounds is not None:
        return html("{} to<br>{}", *(number(bound) for bound in row.bounds))
    return text(number(row.cost))


def _headings(arranged: Sequence[RunRow], here: Sequence[RunRow], group: str) -> dict[int, Markup]:
    """For the first row of each group on the page, what is said of the whole group."""
    of = GROUPS.get(group)
    if of is None:
        return {}
    summary = {value: _summary(list(found)) for value, found in groupby(arranged, key=of)}
    made: dict[int, Markup] = {}
    for i, row in enumerate(here):
        if i == 0 or of(here[i - 1]) != of(row):
            value = of(row)
            chosen = command(f'filter {group}="{value}"') if '"' not in value else Markup("")
            made[i] = html('<span class="seek" {}>{} {}</span> {}', chosen, group, name(value or "–"), summary[value])
    return made


def _summary(rows: Sequence[RunRow]) -> Markup:
    costs = [row.cost for row in rows if row.cost is not None]
    done = sum(row.outcome == "done" for row in rows)
    mean = html(", mean cost {}", number(sum(costs) / len(costs))) if costs else Markup("")
    unknown = f" ({len(rows) - len(costs)} without a cost)" if costs and len(costs) < len(rows) else ""
    return html('<span class="muted">{} runs, {} done{}{}</span>', len(rows), done, mean, unknown)


def _pages(page: int, rows: int) -> Markup:
    """Which rows are on this page, and the way to the others; nothing where all are."""
    if rows <= PAGE_ROWS:
        return Markup("")
    first, last = page * PAGE_ROWS + 1, min((page + 1) * PAGE_ROWS, rows)
    back = html('<span class="seek" {}>‹ before</span> ', command(f"page {page}")) if page else Markup("")
    on = html(' <span class="seek" {}>next ›</span>', command(f"page {page + 2}")) if last < rows else Markup("")
    return html("<p>{}{} to {} of {}{}</p>", back, first, last, rows, on)


def _opened_by(row: RunRow) -> Markup:
    """The strategy's name; a click on it opens the run, where there is a log of it."""
    if row.index < 0:
        return html('<span title="not recorded">{}</span>', name(row.strategy))
    return html(
        '<span class="seek" {} title="{}">{}</span>',
        command(f"open {row.index}"),
        text(row.file),
        name(row.strategy),
    )


def _mark(index: int, shown: tuple[int, ...]) -> Markup:
    if index < 0:
        return Markup("")
    if index in shown:
        return html('<span {} title="remove it">●</span>', command(f"overlay {index}"))
    return html('<span {} title="overlay it"><b>+</b></span>', command(f"overlay {index}"))


def _unbroken(words: Markup) -> Markup:
    """Words that are short enough for one line of a narrow column: deliver-3 would break at its hyphen."""
    return html('<span class="unbroken">{}</span>', words) if len(words) <= UNBROKEN_CHARS else words
