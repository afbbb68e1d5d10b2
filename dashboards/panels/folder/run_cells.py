"""Panel of an evaluation's cells: the mean cost of each strategy in each scenario; a click lists a cell's runs.

A strategy with another estimator is another planner: where runs follow several, each pair has a row of its own. The
least of a scenario is marked only where all of its means are over the same tasks: each strategy once in each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from markupsafe import Markup

from dashboards.panels.folder.runs import RunRow
from dashboards.panels.markup import command, html, name, number
from replayers.batch.beliefs_apart import estimator_labels
from workbench.beliefs.memory.memory_estimator import without_memory

MAX_SIDE = 24
"""Strategies, and scenarios, that have a row or a column."""


def run_cells(rows: Sequence[RunRow]) -> Markup:
    """A row for each strategy, a column for each scenario; nothing where one of them is the same everywhere."""
    planner_of = _planners(rows)
    strategies = sorted(set(planner_of.values()))
    scenarios = sorted({row.scenario for row in rows})
    if len(strategies) < 2 or len(scenarios) < 2:
        return Markup("")
    cells: dict[tuple[str, str], list[RunRow]] = {}
    for row in rows:
        cells.setdefault((planner_of[row.strategy, row.estimator], row.scenario), []).append(row)
    shown = scenarios[:MAX_SIDE]
    head = Markup("").join(html('<th class="n">{}</th>', name(scenario, max_chars=16)) for scenario in shown)
    best = {scenario: _least([cells.get((t, scenario), []) for t in strategies]) for scenario in shown}
    lines = Markup("").join(
        html(
            "<tr><td>{}</td>{}</tr>",
            name(strategy, max_chars=24),
            Markup("").join(
                _cell(found, best[s], apart=any(r.strategy != strategy for r in found))
                for s in shown
                for found in (cells.get((strategy, s), []),)
            ),
        )
        for strategy in strategies[:MAX_SIDE]
    )
    left = max(0, len(strategies) - MAX_SIDE) + max(0, len(scenarios) - MAX_SIDE)
    more = html('<p class="muted">{} more strategies or scenarios are left out.</p>', left) if left else Markup("")
    return html(
        '<div class="lp"><h3>Mean cost by strategy and scenario</h3><table class="lios cells"><thead><tr><th>strategy'
        "</th>{}</tr></thead><tbody>{}</tbody></table>{}"
        '<p class="muted">Bold: the least of a scenario, where all of its means are over runs of the same tasks. '
        "×: runs that were not done. A click lists the runs.</p></div>",
        head,
        lines,
        more,
    )


def _planners(rows: Sequence[RunRow]) -> Mapping[tuple[str, str], str]:
    """What the rows are called by strategy and estimator: by the strategy, where all follow one estimator."""
    pairs = {(row.strategy, row.estimator) for row in rows}
    labels = estimator_labels(without_memory(estimator) for _, estimator in pairs if estimator)
    if len(labels) < 2:
        return {pair: pair[0] for pair in pairs}
    return {(s, e): f"{s} by {labels[without_memory(e)]}" if e else s for s, e in pairs}


def _mean(rows: Sequence[RunRow]) -> float | None:
    costs = [row.cost for row in rows if row.cost is not None]
    return sum(costs) / len(costs) if costs else None


def _least(cells: Sequence[Sequence[RunRow]]) -> float | None:
    """The least mean of a scenario; None where fewer than two strategies have one, or they are over other tasks."""
    means = [mean for rows in cells if (mean := _mean(rows)) is not None]
    tasks = [_tasks(rows) for rows in cells if rows]
    return min(means) if len(means) > 1 and all(each == tasks[0] for each in tasks) else None


def _tasks(rows: Sequence[RunRow]) -> Counter[tuple[str, int, str, bool]]:
    """What the runs of a cell were about: place, seed, the log that a replay is of; and whether a cost is known."""
    return Counter((row.place, row.seed, row.replay_of, row.cost is not None) for row in rows)


def _cell(rows: Sequence[RunRow], best: float | None, *, apart: bool) -> Markup:
    """Args: apart: whether the estimator tells it from other cells."""
    if not rows:
        return Markup('<td class="n muted">–</td>')
    mean, undone = _mean(rows), sum(row.outcome != "done" for row in rows)
    row = rows[0]
    by = f' estimator="{row.estimator}"' if apart and len({r.estimator for r in rows}) == 1 else ""
    click = command(f'filter strategy="{row.strategy}" scenario="{row.scenario}"{by}')
    quoted = '"' in row.strategy + row.scenario + row.estimator
    failed = f" {undone}×" if undone else ""
    bold = mean is not None and mean == best
    shown = html("<b>{}</b>", number(mean)) if bold else number(mean)
    return html(
        '<td class="n" {}>{}<small> n {}{}</small></td>', Markup("") if quoted else click, shown, len(rows), failed
    )
