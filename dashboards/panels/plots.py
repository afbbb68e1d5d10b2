"""How did belief and cost go over time? Two charts on the common clock, as SVG, under the strip's cursor."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from dashboards.clock import Clock
from dashboards.palette import RUNS, css, run_colour
from dashboards.panels.markup import command, number, percent, text
from dashboards.timeline import Timeline
from workbench.worlds.names import readable_name

HEIGHT_PX = 130
TOP_PX, LOW_PX = 16, 8
MOST_LINES = 6
"""Containers whose belief is drawn: those that were ever most believed."""
MOST_POINTS = 600
Line = tuple[str, str, list[tuple[float, float]], bool]
"""Name, colour, points (reading, value), dashed."""
Band = tuple[float, float, float, str]
"""From a reading on: between which values it lies, in which colour: the bounds of a counterfactual."""


def cost_plot(clock: Clock, names: list[str]) -> str:
    """Cost so far of every run, and for the run in focus what its plan still expected at each decision."""
    lines: list[Line] = []
    bands: list[Band] = []
    for row, timeline in enumerate(clock.timelines):
        points = [
            (clock.reading(timeline.stamp(float(s)), run=row), float(c))
            for s, c in _thinned(timeline.cost_s, timeline.cost)
        ]
        lines.append((names[row], css(run_colour(row)), points, False))
        known = timeline.counterfactual
        if known is not None and not known.exact and known.lower is not None and known.upper is not None:
            last = clock.reading(timeline.end_ns, run=row)
            bands.append((last, max(known.lower, points[-1][1]), known.upper, css(run_colour(row))))
    expected = _expected(clock)
    if expected:
        lines.append(("expected in all", css(run_colour(0)), expected, True))
    title = "Cost so far, and what was expected in all (dashed)"
    return _chart(title, lines, clock.end, lambda v: number(v, 0), bands)


def belief_plot(clock: Clock, focus: str) -> str:
    """Belief in one item type over time, for the containers that were ever most believed."""
    if not clock.timelines or not focus:
        return '<div class="lp"><p class="muted">No beliefs to draw.</p></div>'
    timeline = clock.timelines[0]
    series: dict[str, list[tuple[float, float]]] = {}
    for frame in timeline.decisions:
        if frame.belief is None or focus not in frame.belief.item_types:
            continue
        at = clock.reading(frame.stamp_ns)
        row = frame.belief.probability[frame.belief.item_types.index(focus)]
        for container, p in zip(frame.belief.containers, row, strict=True):
            series.setdefault(container, []).append((at, p))
    top = sorted(series, key=lambda c: (-max(p for _, p in series[c]), c))[:MOST_LINES]
    lines = [
        (_name(timeline, c), css(RUNS[i % len(RUNS)]), _held(series[c], timeline, clock), False)
        for i, c in enumerate(top)
    ]
    return _chart(f"Belief in {readable_name(focus)}", lines, clock.end, percent)


def _name(timeline: Timeline, container: str) -> str:
    plan = timeline.plan
    found = next((c for c in plan.containers if c.id == container), None) if plan is not None else None
    return f"{readable_name(found.type)} ({container})" if found is not None else container


def _expected(clock: Clock) -> list[tuple[float, float]]:
    timeline = clock.timelines[0]
    points: list[tuple[float, float]] = []
    for frame in timeline.decisions:
        if frame.plan is not None and frame.plan.steps:
            spent = float(np.interp(timeline.seconds(frame.stamp_ns), timeline.cost_s, timeline.cost))
            points.append((clock.reading(frame.stamp_ns), spent + frame.plan.expected_cost))
    return points


def _held(points: list[tuple[float, float]], timeline: Timeline, clock: Clock) -> list[tuple[float, float]]:
    """A belief holds until the next decision: steps, until the container was searched."""
    made: list[tuple[float, float]] = []
    for i, (at, p) in enumerate(points):
        until = points[i + 1][0] if i + 1 < len(points) else _next_decision(at, timeline, clock)
        made += [(at, p), (until, p)]
    return made


def _next_decision(at: float, timeline: Timeline, clock: Clock) -> float:
    later = [r for r in clock.decisions() if r > at + 1e-9]
    return min(later, default=clock.reading(timeline.end_ns))


def _thinned(x: np.ndarray, y: np.ndarray) -> list[tuple[float, float]]:
    stride = max(1, len(x) // MOST_POINTS)
    kept = sorted({*range(0, len(x), stride), len(x) - 1})
    return [(float(x[i]), float(y[i])) for i in kept]


def _chart(
    title: str, lines: list[Line], end: float, shown: Callable[[float], str], bands: Sequence[Band] = ()
) -> str:
    values = [y for _, _, points, _ in lines for _, y in points] + [high for _, _, high, _ in bands]
    top = max(values, default=0.0) or 1.0
    parts: list[str] = []
    for share in (0.0, 0.5, 1.0):
        y = _y(share)
        parts.append(f'<line x1="0" x2="100%" y1="{y:.1f}" y2="{y:.1f}" stroke="#e6e8eb"/>')
        parts.append(f'<text x="2" y="{y - 2:.1f}">{text(shown(share * top))}</text>')
    drawn = "".join(_line(points, colour, end, top, dashed) for _, colour, points, dashed in reversed(lines))
    drawn += "".join(_band(band, end, top) for band in bands)
    keys = "".join(
        f'<span><span class="dot" style="background:{colour}"></span>{text(name)}</span>'
        for name, colour, _, dashed in lines
        if not dashed
    )
    return (
        f'<div class="lp"><h3>{text(title)}</h3><div class="strip" data-strip="{end}" {command("strip")}>'
        f'<svg width="100%" height="{HEIGHT_PX}">{"".join(parts)}</svg>'
        f'<svg class="over" width="100%" height="{HEIGHT_PX}" viewBox="0 0 1000 {HEIGHT_PX}"'
        ' preserveAspectRatio="none">'
        f'{drawn}</svg><div class="cursor"></div></div><div class="legend">{keys}</div></div>'
    )


def _y(share: float) -> float:
    return TOP_PX + (1 - share) * (HEIGHT_PX - TOP_PX - LOW_PX)


def _band(band: Band, end: float, top: float) -> str:
    at, low, high, colour = band
    x = min(1000 * at / end, 970.0)
    y = _y(high / top)
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{1000 - x:.1f}" height="{max(_y(low / top) - y, 1.0):.1f}"'
        f' fill="{colour}" fill-opacity="0.16" stroke="{colour}" stroke-opacity="0.5" stroke-dasharray="4 3"'
        f' vector-effect="non-scaling-stroke"><title>by the log: {low:.1f} to {high:.1f}</title></rect>'
    )


def _line(points: list[tuple[float, float]], colour: str, end: float, top: float, dashed: bool) -> str:
    at = " ".join(f"{1000 * x / end:.1f},{_y(y / top):.1f}" for x, y in points)
    dash = ' stroke-dasharray="6 4" stroke-opacity="0.7"' if dashed else ""
    return (
        f'<polyline points="{at}" fill="none" stroke="{colour}" stroke-width="1.8"'
        f' vector-effect="non-scaling-stroke"{dash}/>'
    )
