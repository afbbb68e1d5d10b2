"""Line charts of panels, as SVG in fractions of the panel's width, under one cursor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from dashboards.panels.markup import command, html, text

HEIGHT_PX = 128
TOP_PX, LOW_PX = 6, 6
CHART_UNITS = 1000
"""Units across, whatever the panel's width."""
MIN_BAND = 30
MAX_BAND_RATIO = 2.0
"""How far above the highest line, as a multiple of it, bands are shown."""
Point = tuple[float, float]
"""Reading of the clock, value."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One line; keyed ones appear in the legend."""

    name: str
    colour: str
    points: Sequence[Point]
    dashed: bool = False
    keyed: bool = True
    number: str = ""
    """Stands at the line's end, where runs have numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """Bounds of a value from a reading on: those of a counterfactual."""

    name: str
    colour: str
    from_reading: float
    low: float
    high: float


def chart(
    title: str,
    lines: Sequence[Line],
    *,
    end: float,
    unit: str,
    shown: Callable[[float, float], str],
    bands: Sequence[Band] = (),
) -> Markup:
    """The chart with its legend.

    Args:
        end: the last reading of the clock; unit: the unit of readings.
        shown: formats a value at an axis, given the axis's top.
    """
    top = _top(lines, bands)
    marks = Markup("").join(
        html('<span style="top:{:.1f}px">{}</span>', _y(s), text(shown(s * top, top))) for s in (0.0, 0.5, 1.0)
    )
    rules = Markup("").join(
        html(
            '<line x1="0" x2="{}" y1="{:.1f}" y2="{:.1f}" class="grid" vector-effect="non-scaling-stroke"/>',
            CHART_UNITS,
            _y(s),
            _y(s),
        )
        for s in (0.0, 0.5, 1.0)
    )
    drawn = Markup("").join(_band(band, end, top) for band in bands) + Markup("").join(
        _line(line, end, top) for line in reversed(lines)
    )
    banded = {band.name for band in bands}
    keys = [(line.name, line.colour) for line in lines if line.keyed and line.name not in banded]
    keys += [
        (f"{band.name}: {shown(band.low, top)} to {shown(band.high, top)} by the log", band.colour) for band in bands
    ]
    legend = Markup("").join(
        html('<span><span class="dot" style="background:{}"></span>{}</span>', colour, text(name))
        for name, colour in keys
    )
    return html(
        '<div class="lp"><h3>{}</h3><div class="chart"><div class="axis">{}</div><div '
        'class="strip" data-strip="{}" {}><svg width="100%" height="{}" viewBox="0 0 {} {}" '
        'preserveAspectRatio="none">{}{}</svg>{}<div class="cursor"></div></div></div><div '
        'class="ends"><span>0</span><span>{}</span></div><div class="legend">{}</div></div>',
        text(title),
        marks,
        end,
        command("strip"),
        HEIGHT_PX,
        CHART_UNITS,
        HEIGHT_PX,
        rules,
        drawn,
        Markup("").join(_number(line, end, top) for line in lines if line.number and line.points),
        f"{end:.1f} {unit}" if unit else f"{end:g}",
        legend,
    )


def _top(lines: Sequence[Line], bands: Sequence[Band]) -> float:
    """The highest value shown. A band may end above it (the legend says where), so that lines are not flattened."""
    known = max([y for line in lines for _, y in line.points] + [band.low for band in bands], default=0.0)
    reach = max((band.high for band in bands), default=0.0)
    return max(known, min(reach, MAX_BAND_RATIO * known) if known > 0 else reach) or 1.0


def _y(share: float) -> float:
    return TOP_PX + (1 - share) * (HEIGHT_PX - TOP_PX - LOW_PX)


def _band(band: Band, end: float, top: float) -> Markup:
    x = min(CHART_UNITS * band.from_reading / end, CHART_UNITS - MIN_BAND)
    y = max(_y(band.high / top), -TOP_PX)
    return html(
        '<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" '
        'fill-opacity="0.13" stroke="{}" stroke-opacity="0.5" stroke-dasharray="4 3" '
        'vector-effect="non-scaling-stroke"><title>by the log: {:.1f} to {:.1f}</title></rect>',
        x,
        y,
        CHART_UNITS - x,
        max(_y(band.low / top) - y, 1.0),
        band.colour,
        band.colour,
        band.low,
        band.high,
    )


def _number(line: Line, end: float, top: float) -> Markup:
    x, y = line.points[-1]
    at = html("left:{:.1f}%;top:{:.1f}px;color:{}", min(100 * x / end, 97.0), _y(y / top), line.colour)
    return html('<span class="number" style="{}">{}</span>', at, line.number)


def _line(line: Line, end: float, top: float) -> Markup:
    at = Markup(" ").join(f"{CHART_UNITS * x / end:.1f},{_y(y / top):.1f}" for x, y in line.points)
    dash = Markup(' stroke-dasharray="5 4" stroke-opacity="0.8"') if line.dashed else ""
    return html(
        '<polyline points="{}" fill="none" stroke="{}" stroke-width="1.8" '
        'vector-effect="non-scaling-stroke"{}><title>{}</title></polyline>',
        at,
        line.colour,
        dash,
        text(line.name),
    )
