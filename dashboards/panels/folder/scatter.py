"""Scatter plot of two strategies over many runs: one point for each pair of runs of the same task, by their costs.

A click on a point overlays the two runs in 3D. Below the diagonal, the second strategy is cheaper.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from markupsafe import Markup

from dashboards.palette import FAILED, FOUND, css
from dashboards.panels.folder.runs import RunRow
from dashboards.panels.markup import axis_number, command, html, name, number, text
from workbench.beliefs.memory.memory_estimator import without_memory
from workbench.tolerances import NEAR_COST

SIDE_PX = 300
MARGIN_PX = 44
MAX_POINTS = 2000
BASELINES = ("pes-greedy", "opt-greedy", "greedy", "opt-lios", "lios")
OURS = ("conditioned-lios", "scout-lios", "model-lios", "pes-lios", "lios")


def pairs(rows: Sequence[RunRow], first: str, second: str) -> list[tuple[RunRow, RunRow]]:
    """Runs of the same place, task and seed with the same estimator by the two strategies, in the order of the rows.

    Where a strategy has several such runs (a robot's, in other configurations), they are paired by file names that
    are equal except for the strategy; what remains ambiguous is left out.
    """
    wanted = [row for row in rows if row.cost is not None and row.strategy in (first, second)]
    several = {trial for (trial, _), count in Counter((_trial(r), r.strategy) for r in wanted).items() if count > 1}
    runs: dict[tuple[str, tuple[str, str, int, str], str], list[RunRow]] = {}
    for row in wanted:
        trial = _trial(row)
        runs.setdefault((row.strategy, trial, _without_strategy(row) if trial in several else ""), []).append(row)
    found: list[tuple[RunRow, RunRow]] = []
    for (strategy, trial, which), mine in runs.items():
        other = runs.get((second, trial, which), [])
        if strategy == first and len(mine) == len(other) == 1:
            found.append((mine[0], other[0]))
    return found[:MAX_POINTS]


def scatter(rows: Sequence[RunRow], first: str, second: str) -> Markup:
    """The points of two strategies."""
    found = pairs(rows, first, second)
    if not found:
        return html(
            '<div class="lp"><p class="muted">No task was run by both {} and {}.</p></div>', name(first), name(second)
        )
    top = max(cost for a, b in found for cost in (a.cost or 0.0, b.cost or 0.0)) or 1.0
    points = Markup("").join(_point(a, b, top) for a, b in found)
    low, high, middle = MARGIN_PX, SIDE_PX - 6, SIDE_PX / 2
    ticks = Markup("").join(_tick(share, top) for share in (0.0, 0.5, 1.0))
    below = sum((b.cost or 0.0) < (a.cost or 0.0) - NEAR_COST for a, b in found)
    above = sum((b.cost or 0.0) > (a.cost or 0.0) + NEAR_COST for a, b in found)
    tasks = "task" if len(found) == 1 else "tasks"
    return html(
        '<div class="lp"><svg width="{}" height="{}" role="img"><line x1="{}" y1="{}" x2="{}" '
        'y2="{}" class="grid"/>{}<text x="{}" y="{}" text-anchor="middle">cost of {}</text>'
        '<text x="9" y="{}" text-anchor="middle" transform="rotate(-90 9 {})">cost of {}'
        "</text>{}</svg><p>{} {}: {} costs {} than {} on average; it is cheaper in {} and more "
        'expensive in {}.</p><p class="muted">Under the line the second is cheaper; red square: one '
        "of the two failed; pale: not recorded. A click on a point opens its two runs.</p></div>",
        SIDE_PX,
        SIDE_PX,
        low,
        SIDE_PX - low,
        high,
        SIDE_PX - high,
        ticks,
        (low + high) / 2,
        SIDE_PX - 3,
        text(first),
        middle,
        middle,
        text(second),
        points,
        len(found),
        tasks,
        name(second),
        _difference(found),
        name(first),
        below,
        above,
    )


def default_pair(strategies: Sequence[str]) -> tuple[str, str]:
    """Which two to show first: a baseline across, one of ours up; else the first two."""
    across = next((name for name in BASELINES if name in strategies), strategies[0])
    up = next((name for name in OURS if name in strategies and name != across), None)
    return across, up or next((name for name in strategies if name != across), across)


def _difference(found: Sequence[tuple[RunRow, RunRow]]) -> str:
    mean = sum((b.cost or 0.0) - (a.cost or 0.0) for a, b in found) / len(found)
    return f"{number(abs(mean), 2)} {'more' if mean > 0 else 'less'}"


def _trial(row: RunRow) -> tuple[str, str, int, str]:
    return (row.place, row.scenario, row.seed, without_memory(row.estimator))


def _without_strategy(row: RunRow) -> str:
    """ "spot-home-A" for spot-home-A-pes-greedy.mcap."""
    return row.file.removesuffix(".mcap").replace(row.strategy, "").strip("-_.")


def _at(cost: float, top: float) -> float:
    return MARGIN_PX + cost / top * (SIDE_PX - 6 - MARGIN_PX)


def _point(a: RunRow, b: RunRow, top: float) -> Markup:
    x, y = _at(a.cost or 0.0, top), SIDE_PX - _at(b.cost or 0.0, top)
    done = a.outcome == b.outcome == "done"
    logs = [str(row.index) for row in (a, b) if row.index >= 0]
    click = command(f"open {','.join(logs)}") if logs else ""
    title = html("<title>{}: {}, {} and {}</title>", text(a.place), text(a.scenario), number(a.cost), number(b.cost))
    colour, opacity = css(FOUND if done else FAILED), 0.65 if logs else 0.25
    look = html('fill="{}" fill-opacity="{}" stroke="white" {}', colour, opacity, click)
    if done:
        return html('<circle cx="{:.1f}" cy="{:.1f}" r="4.5" {}>{}</circle>', x, y, look, title)
    return html('<rect x="{:.1f}" y="{:.1f}" width="8" height="8" {}>{}</rect>', x - 4, y - 4, look, title)


def _tick(share: float, top: float) -> Markup:
    at = _at(share * top, top)
    label = axis_number(share * top, top)
    return html(
        '<text x="{:.1f}" y="{}" text-anchor="{}">{}</text><text x="{}" y="{:.1f}" text-anchor="end">{}</text>',
        at,
        SIDE_PX - MARGIN_PX + 13,
        "end" if share == 1 else "middle",
        label,
        MARGIN_PX - 3,
        SIDE_PX - at + 4,
        label,
    )
