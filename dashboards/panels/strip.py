"""Strip of phases of each run (moving, searching, manipulating, planning) on the common clock."""

from __future__ import annotations

from dashboards.model.clock import UNITS, Clock
from dashboards.palette import PHASES, Colour, css
from dashboards.panels.markup import command, dot, name, text

ROW_PX = 16
TOP_PX = 14
LAST_LABEL = 93
"""Per cent of the width; a label beyond this is drawn left of its line, to fit."""
MAX_PHASES = 800
"""The most phases drawn one by one; in a longer run neighbouring phases are joined."""


def strip(clock: Clock, names: list[str], colours: list[Colour]) -> str:
    """Rows of phases with ticks at decisions; a click seeks. Drawn once; `cursor` moves over it."""
    end = clock.end
    height = TOP_PX + ROW_PX * len(clock.timelines) + 2
    parts = [_axis(end, UNITS[clock.alignment], height)]
    for row, timeline in enumerate(clock.timelines):
        y = TOP_PX + row * ROW_PX
        phases = timeline.phases
        stride = max(1, len(phases) // MAX_PHASES)
        for first in range(0, len(phases), stride):
            block = phases[first : first + stride]
            a, b = clock.position(block[0].start_ns, run=row), clock.position(block[-1].end_ns, run=row)
            parts.append(_phase(a / end, b / end, y, block[0].name, block[0].title, block[0].support))
        for stamp in timeline.decision_ns[:: max(1, len(timeline.decision_ns) // MAX_PHASES)]:
            x = _x(clock.reading(stamp, run=row) / end)
            parts.append(f'<line x1="{x:.3f}%" x2="{x:.3f}%" y1="{y - 2}" y2="{y + ROW_PX - 3}" stroke="#23262b"/>')
    runs = "".join(f"<span>{dot(colours[i])}{name(names[i])}</span>" for i in range(len(names)))
    keys = "".join(
        f'<span><span class="dot" style="background:{colour}"></span>{text(phase)}</span>'
        for phase, colour in PHASES.items()
    )
    several = len(names) > 1
    single = f'<div class="legend">{runs}</div>' if several else ""
    return (
        f'<div class="lp"><div class="rows">{_whose(names, colours) if several else ""}'
        f'<div class="strip" data-strip="{end}" {command("strip")}>'
        f'<svg width="100%" height="{height}">{"".join(parts)}</svg><div class="cursor"></div></div></div>'
        f'{single}<div class="legend">{keys}<span>| decision</span></div></div>'
    )


def _whose(names: list[str], colours: list[Colour]) -> str:
    """Before each row the colour of its run, with its name."""
    marks = "".join(
        f'<span style="top:{TOP_PX + row * ROW_PX}px;height:{ROW_PX - 3}px;background:{css(colours[row])}"'
        f' title="{text(name)}"></span>'
        for row, name in enumerate(names)
    )
    return f'<div class="whose">{marks}</div>'


def cursor(clock: Clock, reading: float) -> str:
    """A style sheet that puts the strip's cursor at a reading."""
    return f"<style>.lp .strip .cursor{{left:{_x(reading / clock.end):.3f}%}}</style>"


def _x(share: float) -> float:
    return 100 * min(max(share, 0.0), 1.0)


def _phase(a: float, b: float, y: int, phase: str, title: str, support: str) -> str:
    x, width = _x(a), max(_x(b) - _x(a), 0.06)
    dashed = (
        ' fill-opacity="0.45" stroke="#23262b" stroke-dasharray="3 2" stroke-width="0.6"'
        if support == "imputed"
        else ""
    )
    return (
        f'<rect x="{x:.3f}%" y="{y}" width="{width:.3f}%" height="{ROW_PX - 3}" fill="{PHASES[phase]}"{dashed}>'
        f"<title>{text(title)}</title></rect>"
    )


def _axis(end: float, unit: str, height: int) -> str:
    """Ticks at round readings. Only the first names the unit, so that the others do not overlap in a narrow
    window."""
    step = _round_step(end / 8)
    marks: list[str] = []
    at = 0.0
    while at <= end * 1.0001:
        x = _x(at / end)
        marks.append(f'<line x1="{x:.2f}%" x2="{x:.2f}%" y1="10" y2="{height}" stroke="#e3e5e8"/>')
        label = f"{at:g}{' ' + unit if unit and not at else ''}"
        anchor = "" if x < LAST_LABEL else ' text-anchor="end"'
        marks.append(f'<text x="{x:.2f}%" y="9"{anchor}>{label}</text>')
        at += step
    return "".join(marks)


def _round_step(step: float) -> float:
    size = 10.0 ** int(f"{step:e}".split("e")[1])
    return next((m * size for m in (1, 2, 5, 10) if m * size >= step), step)
