"""How did cost, what was still expected, and belief go over time? Three charts on the common clock."""

from __future__ import annotations

import itertools
from bisect import bisect_right

import numpy as np

from dashboards.clock import Clock
from dashboards.palette import RUNS, css, run_colour
from dashboards.panels.chart import Band, Line, Point, chart
from dashboards.panels.markup import number, percent
from dashboards.timeline import Timeline
from workbench.worlds.names import readable_name

MOST_LINES = 6
"""Containers whose belief is drawn: those that were ever most believed."""
MOST_POINTS = 600


def plots(clock: Clock, names: list[str], focus: str) -> str:
    """All three."""
    return cost_plot(clock, names) + remaining_plot(clock, names) + belief_plot(clock, focus)


def cost_plot(clock: Clock, names: list[str]) -> str:
    """Cost so far of every run, dashed where a replay assumed it; bounds where the log does not decide its end."""
    lines: list[Line] = []
    bands: list[Band] = []
    for row, timeline in enumerate(clock.timelines):
        colour = css(run_colour(row))
        lines += _cost_lines(timeline, clock, row, names[row], colour)
        known = timeline.counterfactual
        if known is not None and not known.exact and known.lower is not None and known.upper is not None:
            last = clock.reading(timeline.end_ns, run=row)
            low = max(known.lower, float(timeline.cost[-1]))
            bands.append(Band(name=names[row], colour=colour, from_reading=last, low=low, high=known.upper))
    return chart("Cost so far", lines, end=clock.end, shown=lambda v: number(v, 0), bands=bands)


def remaining_plot(clock: Clock, names: list[str]) -> str:
    """What the plan in force still expected to spend: it falls as the run spends, and jumps at decisions."""
    lines = [
        Line(name=names[row], colour=css(run_colour(row)), points=points)
        for row, timeline in enumerate(clock.timelines)
        if (points := _remaining(timeline, clock, row))
    ]
    if not lines:
        return '<div class="lp"><p class="muted">No plan said what it expected.</p></div>'
    return chart("Expected remaining cost", lines, end=clock.end, shown=lambda v: number(v, 0))


def belief_plot(clock: Clock, focus: str) -> str:
    """Belief in one item type over time, for the containers that were ever most believed."""
    if not clock.timelines or not focus:
        return '<div class="lp"><p class="muted">No beliefs to draw.</p></div>'
    timeline = clock.timelines[0]
    series: dict[str, list[Point]] = {}
    for frame in timeline.decisions:
        if frame.belief is None or focus not in frame.belief.item_types:
            continue
        at = clock.reading(frame.stamp_ns)
        row = frame.belief.probability[frame.belief.item_types.index(focus)]
        for container, p in zip(frame.belief.containers, row, strict=True):
            series.setdefault(container, []).append((at, p))
    top = sorted(series, key=lambda c: (-max(p for _, p in series[c]), c))[:MOST_LINES]
    lines = [
        Line(name=_name(timeline, c), colour=css(RUNS[i % len(RUNS)]), points=_held(series[c], timeline, clock))
        for i, c in enumerate(top)
    ]
    return chart(f"Belief in {readable_name(focus)}", lines, end=clock.end, shown=percent)


def _cost_lines(timeline: Timeline, clock: Clock, row: int, name: str, colour: str) -> list[Line]:
    """The line in pieces, each solid or dashed; only the first stands in the key."""
    kept = _thinned(len(timeline.cost_s))
    seconds, cost = timeline.cost_s[kept], timeline.cost[kept]
    points = [
        (clock.reading(timeline.stamp(float(s)), run=row), float(c)) for s, c in zip(seconds, cost, strict=True)
    ]
    starts = [p.start_ns for p in timeline.phases]

    def assumed(i: int) -> bool:
        middle = timeline.stamp(float(seconds[i] + seconds[i + 1]) / 2)
        at = bisect_right(starts, middle) - 1
        return at >= 0 and timeline.phases[at].support == "imputed"

    pieces = [
        (dashed, list(group)) for dashed, group in itertools.groupby(range(max(len(points) - 1, 0)), key=assumed)
    ]
    return [
        Line(name=name, colour=colour, points=points[g[0] : g[-1] + 2], dashed=dashed, keyed=i == 0)
        for i, (dashed, g) in enumerate(pieces)
    ] or [Line(name=name, colour=colour, points=points)]


def _remaining(timeline: Timeline, clock: Clock, row: int) -> list[Point]:
    """At each decision its plan's expected cost, then less by what was spent, never below 0."""
    points: list[Point] = []
    frames = timeline.decisions
    for i, frame in enumerate(frames):
        if frame.plan is None or not frame.plan.steps:
            continue
        until = frames[i + 1].stamp_ns if i + 1 < len(frames) else timeline.end_ns
        spent_before = _cost_at(timeline, frame.stamp_ns)
        stamps = sorted({frame.stamp_ns, until, *(a.stamp.ns for a in frame.actions if a.stamp.ns < until)})
        for stamp in stamps:
            left = frame.plan.expected_cost - (_cost_at(timeline, stamp) - spent_before)
            points.append((clock.reading(stamp, run=row), max(0.0, left)))
    return [points[i] for i in _thinned(len(points))]


def _cost_at(timeline: Timeline, stamp_ns: int) -> float:
    return float(np.interp(timeline.seconds(stamp_ns), timeline.cost_s, timeline.cost))


def _name(timeline: Timeline, container: str) -> str:
    plan = timeline.plan
    found = next((c for c in plan.containers if c.id == container), None) if plan is not None else None
    return f"{readable_name(found.type)} ({container})" if found is not None else container


def _held(points: list[Point], timeline: Timeline, clock: Clock) -> list[Point]:
    """A belief holds until the next decision: steps, until the container was searched."""
    made: list[Point] = []
    for i, (at, p) in enumerate(points):
        until = points[i + 1][0] if i + 1 < len(points) else _next_decision(at, timeline, clock)
        made += [(at, p), (until, p)]
    return made


def _next_decision(at: float, timeline: Timeline, clock: Clock) -> float:
    later = [r for r in clock.decisions() if r > at + 1e-9]
    return min(later, default=clock.reading(timeline.end_ns))


def _thinned(count: int) -> list[int]:
    stride = max(1, count // MOST_POINTS)
    return sorted({*range(0, count, stride), *([count - 1] if count else [])})
