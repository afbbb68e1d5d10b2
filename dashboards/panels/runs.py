"""Panel of the runs in a folder, as a table with filters; a click opens a run or overlays it."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from dashboards.panels.markup import breakable, command, html, name, number, table, text


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """One log in the table."""

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


MAX_ROWS = 300


def runs(rows: list[RunRow], shown: tuple[int, ...], *, total: int) -> Markup:
    """The rows that pass the filters; those shown are marked."""
    if not rows:
        return html('<div class="lp"><p class="muted">None of {} runs passes the filters.</p></div>', total)
    cells = [
        [
            _mark(row.index, shown),
            _opened_by(row),
            name(row.scenario),
            name(row.strategy) + (Markup(' <span class="muted">replay</span>') if row.source == "replay" else ""),
            str(row.seed),
            breakable(row.file),
            name(row.outcome),
            number(row.cost),
            "–" if row.searches is None else str(row.searches),
        ]
        for row in rows[:MAX_ROWS]
    ]
    head = ("", "place", "scenario", "strategy", "seed", "file", "outcome", "cost", "looks")
    more = (
        html('<p class="muted">and {} more; filter to see them</p>', len(rows) - MAX_ROWS)
        if len(rows) > MAX_ROWS
        else ""
    )
    count = html('<p class="muted">{} of {} runs. A name opens a run; + overlays it.</p>', len(rows), total)
    made = table(head, cells, key="runs", classes=("", "", "", "", "n", "", "", "n", "n"))
    return html('<div class="lp">{}{}{}</div>', count, made, more)


def passes(row: RunRow, words: str) -> bool:
    """Whether every word occurs in the row; "cost<50" and "cost>50" compare."""
    haystack = f"{row.file} {row.place} {row.scenario} {row.strategy} {row.source} {row.outcome}".lower()
    for word in words.lower().split():
        if word.startswith(("cost<", "cost>")):
            try:
                bound = float(word[5:])
            except ValueError:
                continue
            if row.cost is None or not (row.cost < bound if word[4] == "<" else row.cost > bound):
                return False
        elif word not in haystack:
            return False
    return True


def _opened_by(row: RunRow) -> Markup:
    """The place's name; a click on it opens the run, where there is a log of it."""
    if row.index < 0:
        return html('<span title="not recorded">{}</span>', breakable(row.place))
    return html(
        '<span class="seek" {} title="{}">{}</span>',
        command(f"open {row.index}"),
        text(row.file),
        breakable(row.place),
    )


def _mark(index: int, shown: tuple[int, ...]) -> Markup:
    if index < 0:
        return Markup("")
    if index in shown:
        return html('<span {} title="remove it">●</span>', command(f"overlay {index}"))
    return html('<span {} title="overlay it"><b>+</b></span>', command(f"overlay {index}"))
