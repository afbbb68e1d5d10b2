"""Line charts of panels, as SVG in fractions of the panel's width, under one cursor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from dashboards.panels.markup import command, text

HEIGHT_PX = 128
TOP_PX, LOW_PX = 6, 6
WIDE = 1000
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """From a reading on, bounds between which a value lies: those of a counterfactual."""

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
) -> str:
    """The chart with its legend.

    Args:
        end: the last reading of the clock; unit: the unit of readings.
        shown: formats a value at an axis, given the axis's top.
    """
    top = _top(lines, bands)
    marks = "".join(f'<span style="top:{_y(s):.1f}px">{text(shown(s * top, top))}</span>' for s in (0.0, 0.5, 1.0))
    rules = "".join(
        f'<line x1="0" x2="{WIDE}" y1="{_y(s):.1f}" y2="{_y(s):.1f}" stroke="#e6e8eb"'
        ' vector-effect="non-scaling-stroke"/>'
        for s in (0.0, 0.5, 1.0)
    )
    drawn = "".join(_band(band, end, top) for band in bands) + "".join(
        _line(line, end, top) for line in reversed(lines)
    )
    banded = {band.name for band in bands}
    keys = [(line.name, line.colour) for line in lines if line.keyed and line.name not in banded]
    keys += [
        (f"{band.name}: {shown(band.low, top)} to {shown(band.high, top)} by the log", band.colour) for band in bands
    ]
    legend = "".join(
        f'<span><span class="dot" style="background:{colour}"></span>{text(name)}</span>' for name, colour in keys
    )
    return (
        f'<div class="lp"><h3>{text(title)}</h3><div class="chart"><div class="axis">{marks}</div>'
        f'<div class="strip" data-strip="{end}" {command("strip")}>'
        f'<svg width="100%" height="{HEIGHT_PX}" viewBox="0 0 {WIDE} {HEIGHT_PX}" preserveAspectRatio="none">'
        f'{rules}{drawn}</svg><div class="cursor"></div></div></div>'
        f'<div class="ends"><span>0</span><span>{f"{end:.1f} {unit}" if unit else f"{end:g}"}</span></div>'
        f'<div class="legend">{legend}</div></div>'
    )


def _top(lines: Sequence[Line], bands: Sequence[Band]) -> float:
    """The highest value shown. A band may end above it (the legend says where), so that lines are not flattened."""
    known = max([y for line in lines for _, y in line.points] + [band.low for band in bands], default=0.0)
    reach = max((band.high for band in bands), default=0.0)
    return max(known, min(reach, MAX_BAND_RATIO * known) if known > 0 else reach) or 1.0


def _y(share: float) -> float:
    return TOP_PX + (1 - share) * (HEIGHT_PX - TOP_PX - LOW_PX)


def _band(band: Band, end: float, top: float) -> str:
    x = min(WIDE * band.from_reading / end, WIDE - MIN_BAND)
    y = max(_y(band.high / top), -TOP_PX)
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{WIDE - x:.1f}" height="{max(_y(band.low / top) - y, 1.0):.1f}"'
        f' fill="{band.colour}" fill-opacity="0.13" stroke="{band.colour}" stroke-opacity="0.5"'
        f' stroke-dasharray="4 3" vector-effect="non-scaling-stroke">'
        f"<title>by the log: {band.low:.1f} to {band.high:.1f}</title></rect>"
    )


def _line(line: Line, end: float, top: float) -> str:
    at = " ".join(f"{WIDE * x / end:.1f},{_y(y / top):.1f}" for x, y in line.points)
    dash = ' stroke-dasharray="5 4" stroke-opacity="0.8"' if line.dashed else ""
    return (
        f'<polyline points="{at}" fill="none" stroke="{line.colour}" stroke-width="1.8"'
        f' vector-effect="non-scaling-stroke"{dash}><title>{text(line.name)}</title></polyline>'
    )
