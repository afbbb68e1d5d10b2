"""Charts of cost, remaining expected cost, and belief over time, on the common clock."""

from __future__ import annotations

import itertools
from bisect import bisect_right

import numpy as np
from markupsafe import Markup

from dashboards.model.belief_series import belief_series
from dashboards.model.clock import UNITS, Clock
from dashboards.model.labels import place_words
from dashboards.model.timeline import Timeline
from dashboards.palette import css, run_colour, run_number
from dashboards.panels.chart import Band, Line, Point, chart
from dashboards.panels.markup import axis_number, percent
from workbench.tolerances import ROUNDING
from workbench.worlds.names import readable_name

MAX_POINTS = 600


def plots(clock: Clock, names: list[str], focus: str) -> Markup:
    """All three charts."""
    return cost_plot(clock, names) + remaining_plot(clock, names) + belief_plot(clock, focus)


def cost_plot(clock: Clock, names: list[str]) -> Markup:
    """Cost so far of every run, dashed where a replay assumed it; bounds where the log cannot settle the final
    cost."""
    lines: list[Line] = []
    bands: list[Band] = []
    for row, timeline in enumerate(clock.timelines):
        colour = css(run_colour(row))
        lines += _cost_lines(timeline, clock, row, names[row], colour)
        if timeline.undecided is not None:
            lower, upper = timeline.undecided
            last = clock.reading(timeline.end_ns, run=row)
            low = max(lower, float(timeline.cost[-1]))
            bands.append(Band(name=names[row], colour=colour, from_reading=last, low=low, high=upper))
    return chart("Cost so far", lines, end=clock.end, unit=UNITS[clock.alignment], shown=axis_number, bands=bands)


def remaining_plot(clock: Clock, names: list[str]) -> Markup:
    """Expected remaining cost of the plan in force: it falls as the run spends, and jumps at decisions."""
    lines = [
        Line(
            name=names[row],
            colour=css(run_colour(row)),
            points=points,
            number=run_number(row, len(clock.timelines)),
        )
        for row, timeline in enumerate(clock.timelines)
        if (points := _remaining(timeline, clock, row))
    ]
    if not lines:
        return Markup('<div class="lp"><p class="muted">No plan said what it expected.</p></div>')
    return chart("Expected remaining cost", lines, end=clock.end, unit=UNITS[clock.alignment], shown=axis_number)


def belief_plot(clock: Clock, focus: str) -> Markup:
    """Belief in one item type over time, for the containers that were ever most believed."""
    if not clock.timelines or not focus:
        return Markup('<div class="lp"><p class="muted">No beliefs to draw.</p></div>')
    timeline = clock.timelines[0]
    lines = [
        Line(
            name=place_words(container),
            colour=css(run_colour(i)),
            points=_held([(clock.reading(stamp), p) for stamp, p in series], timeline, clock),
        )
        for i, (container, series) in enumerate(belief_series(timeline, focus).items())
    ]
    title = f"Belief in {readable_name(focus)}"
    return chart(title, lines, end=clock.end, unit=UNITS[clock.alignment], shown=lambda value, _: percent(value))


def _cost_lines(timeline: Timeline, clock: Clock, row: int, name: str, colour: str) -> list[Line]:
    """The line in pieces, each solid or dashed; only the first appears in the legend."""
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
        Line(
            name=name,
            colour=colour,
            points=points[g[0] : g[-1] + 2],
            dashed=dashed,
            keyed=i == 0,
            number=run_number(row, len(clock.timelines)) if i == len(pieces) - 1 else "",
        )
        for i, (dashed, g) in enumerate(pieces)
    ] or [Line(name=name, colour=colour, points=points)]


def _remaining(timeline: Timeline, clock: Clock, row: int) -> list[Point]:
    """At each decision its plan's expected cost, then minus what was spent since, never below 0."""
    points: list[Point] = []
    frames = timeline.decisions
    for i, frame in enumerate(frames):
        if frame.plan is None or not frame.plan.steps or frame.plan.expected_cost is None:
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


def _held(points: list[Point], timeline: Timeline, clock: Clock) -> list[Point]:
    """Step lines: a belief holds until the next decision, and ends when the container is searched."""
    made: list[Point] = []
    for i, (at, p) in enumerate(points):
        until = points[i + 1][0] if i + 1 < len(points) else _next_decision(at, timeline, clock)
        made += [(at, p), (until, p)]
    return made


def _next_decision(at: float, timeline: Timeline, clock: Clock) -> float:
    later = [r for r in clock.decisions() if r > at + ROUNDING]
    return min(later, default=clock.reading(timeline.end_ns))


def _thinned(count: int) -> list[int]:
    stride = max(1, count // MAX_POINTS)
    return sorted({*range(0, count, stride), *([count - 1] if count else [])})
