"""Panel of the ghosts beside a run that is being recorded: what each would cost, and what that proves."""

from __future__ import annotations

from math import isfinite

from markupsafe import Markup

from dashboards.palette import Colour
from dashboards.panels.markup import dot, html, name, number, table, text
from replayers.live.ghost_bounds import GhostBounds, GhostReport

MAX_STRATEGY_CHARS = 28
MAX_TROUBLE_CHARS = 160
HINTS = {
    "at least": "The cost in the cheapest world that agrees with the log so far.",
    "at most": "The cost in the most expensive such world; - where no bound is known.",
    "driven costs more": "The driven strategy's cost minus this one's, both replayed on the map, world by world.",
}
WIDE_TREE_NOTE = "~ : the tree of runs was too wide for the time; these bounds hold, but may be wider than necessary."


def ghosts(report: GhostReport | None, colours: dict[str, Colour]) -> Markup:
    """The verdict, a row for each strategy with its bounds, and how far the log was read.

    Args:
        report: the newest round; None where no ghosts run.
        colours: of the runs on show, by strategy.
    """
    if report is None:
        return Markup("")
    parts = [Markup('<div class="lp ghosts">')]
    if report.line:
        parts.append(html('<p data-live="verdict"><b>{}</b></p>', text(report.line)))
    if report.bounds:
        rows = [_row(bounds, colours) for bounds in report.bounds]
        head = ("beside the run", *HINTS)
        parts.append(table(head, rows, key="ghosts", classes=("w", "n", "n", "n"), hints=HINTS))
        if any(bounds.outer for bounds in report.bounds):
            parts.append(html('<p class="muted">{}</p>', WIDE_TREE_NOTE))
        parts.append(
            html(
                '<p class="muted">As of decision {}, {} containers known; replayed in {} s.</p>',
                report.decisions,
                report.opened,
                number(report.seconds),
            )
        )
    elif not report.note and not report.ended:
        parts.append(Markup('<p class="muted">Ghosts: the first replay is being made.</p>'))
    for note in (report.note, report.ended if not report.ended.startswith("The run has") else ""):
        if note:
            parts.append(html('<div class="warn">{}</div>', text(note)))
    return Markup("").join(parts) + Markup("</div>")


def _row(bounds: GhostBounds, colours: dict[str, Colour]) -> list[Markup]:
    colour = colours.get(bounds.strategy)
    mark = dot(colour) if colour is not None else Markup("")
    driven = Markup(" <small>(driven)</small>") if bounds.driven else Markup("")
    named = html("{}{}{}", mark, name(bounds.strategy, max_chars=MAX_STRATEGY_CHARS), driven)
    if bounds.trouble:
        why = html("<br><small>{}</small>", name(bounds.trouble, max_chars=MAX_TROUBLE_CHARS))
        return [named + why, text("-"), text("-"), text("-")]
    wide = "~" if bounds.outer else ""
    if bounds.charged is not None:  # the same figure as in the panel; the others compare with its replay
        replayed = html("<br><small>replayed {}</small>", _figure(bounds.lower)) if _differs(bounds) else Markup("")
        return [named + replayed, *[text(_figure(bounds.charged))] * 2, text("")]
    extra = "" if bounds.driven else f"{_figure(bounds.least_extra)} to {_figure(bounds.most_extra)}"
    return [named, text(wide + _figure(bounds.lower)), text(wide + _figure(bounds.upper)), text(extra)]


def _differs(bounds: GhostBounds) -> bool:
    """Whether the driven run's replay cost visibly another sum than the robot was charged."""
    return bounds.exact and _figure(bounds.lower) != _figure(bounds.charged or 0.0)


def _figure(value: float) -> str:
    return str(number(value)) if isfinite(value) else "-"
