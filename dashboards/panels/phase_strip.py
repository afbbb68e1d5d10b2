"""Strip of phases of each run (moving, searching, manipulating, planning) on the common clock."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from dashboards.model.clock import UNITS, Clock
from dashboards.model.phases import Phase
from dashboards.palette import PHASES, Colour, css, ink, run_number
from dashboards.panels.markup import command, dot, html, name, text
from replayers.log_tools.notes import RunNote

ROW_PX, NARROW_PX = 16, 12
"""Height of a run's row; of many runs, so that their house keeps its room."""
MANY_ROWS = 6
TOP_PX = 14
LAST_LABEL = 93
"""Per cent of the width; a label beyond this is drawn left of its line, to fit."""
MAX_PHASES = 800
"""The most phases drawn one by one; in a longer run neighbouring phases are joined."""

MAX_NOTES, MAX_NOTE_CHARS = 200, 400
"""Notes marked on one row, and characters of each in its tooltip."""


def strip(clock: Clock, names: list[str], colours: list[Colour], notes: Sequence[tuple[RunNote, ...]] = ()) -> Markup:
    """Rows of phases with ticks at decisions; a click seeks. Drawn once; `cursor` moves over it.

    Args:
        notes: of each run, marked on its row with their words as tooltips.
    """
    end = clock.end
    row_px = ROW_PX if len(clock.timelines) <= MANY_ROWS else NARROW_PX
    height = TOP_PX + row_px * len(clock.timelines) + 2
    parts = [_axis(end, UNITS[clock.alignment], height)]
    for row, timeline in enumerate(clock.timelines):
        y = TOP_PX + row * row_px
        phases = timeline.phases
        stride = max(1, len(phases) // MAX_PHASES)
        for first in range(0, len(phases), stride):
            block = phases[first : first + stride]
            a, b = clock.position(block[0].start_ns, run=row), clock.position(block[-1].end_ns, run=row)
            parts.append(_phase((a / end, b / end), y, row_px, block[0]))
        for stamp in timeline.decision_ns[:: max(1, len(timeline.decision_ns) // MAX_PHASES)]:
            x = _x(clock.reading(stamp, run=row) / end)
            parts.append(
                html('<line x1="{:.3f}%" x2="{:.3f}%" y1="{}" y2="{}" class="mark"/>', x, x, y - 2, y + row_px - 3)
            )
        for note in (notes[row] if row < len(notes) else ())[:MAX_NOTES]:
            parts.append(_note(_x(clock.reading(note.start_ns, run=row) / end), y + row_px, note))
    runs = Markup("").join(html("<span>{}{}</span>", dot(colours[i]), name(names[i])) for i in range(len(names)))
    keys = Markup("").join(
        html('<span><span class="dot" style="background:{}"></span>{}</span>', colour, text(phase))
        for phase, colour in PHASES.items()
    )
    several = len(names) > 1
    single = html('<div class="legend">{}</div>', runs) if several else ""
    return html(
        '<div class="lp lios-timeline"><div class="rows">{}<div class="strip" data-strip="{}" {}><svg '
        'width="100%" height="{}">{}</svg><div class="cursor"></div></div></div>{}<div '
        'class="legend">{}<span>| decision</span>{}</div></div>',
        _whose(names, colours, row_px) if several else "",
        end,
        command("strip"),
        height,
        Markup("").join(parts),
        single,
        keys,
        Markup("<span>▼ note</span>") if any(notes) else "",
    )


def _note(x: float, bottom: int, note: RunNote) -> Markup:
    """A triangle at the time that a note is about."""
    who = f"{note.author}: " if note.author else ""
    return html(
        '<text x="{:.3f}%" y="{}" text-anchor="middle" class="note">▼<title>{}</title></text>',
        x,
        bottom - 5,
        text(f"{who}{note.text}"[:MAX_NOTE_CHARS]),
    )


def _whose(names: list[str], colours: list[Colour], row_px: int) -> Markup:
    """Before each row the colour of its run, with its name."""
    marks = Markup("").join(
        html(
            '<span style="top:{}px;height:{}px;color:{};background:{}" title="{}">{}</span>',
            TOP_PX + row * row_px,
            row_px - 3,
            ink(colours[row]),
            css(colours[row]),
            text(name),
            run_number(row, len(names)),
        )
        for row, name in enumerate(names)
    )
    return html('<div class="whose{}">{}</div>', " numbered" if run_number(0, len(names)) else "", marks)


def cursor(clock: Clock, reading: float) -> Markup:
    """A style sheet that puts the strip's cursor at a reading."""
    return html("<style>.lp .strip .cursor{{left:{:.3f}%}}</style>", _x(reading / clock.end))


def _x(share: float) -> float:
    return 100 * min(max(share, 0.0), 1.0)


def _phase(shares: tuple[float, float], y: int, row_px: int, phase: Phase) -> Markup:
    x, width = _x(shares[0]), max(_x(shares[1]) - _x(shares[0]), 0.06)
    dashed = (
        Markup(' fill-opacity="0.45" class="mark" stroke-dasharray="3 2" stroke-width="0.6"')
        if phase.support == "imputed"
        else ""
    )
    return html(
        '<rect x="{:.3f}%" y="{}" width="{:.3f}%" height="{}" fill="{}"{}><title>{}</title></rect>',
        x,
        y,
        width,
        row_px - 3,
        PHASES[phase.name],
        dashed,
        text(phase.title),
    )


def _axis(end: float, unit: str, height: int) -> Markup:
    """Ticks at round readings. Only the first names the unit, so that the others do not overlap in a narrow
    window."""
    step = _round_step(end / 8)
    marks: list[str] = []
    at = 0.0
    while at <= end * 1.0001:
        x = _x(at / end)
        marks.append(html('<line x1="{:.2f}%" x2="{:.2f}%" y1="10" y2="{}" class="grid"/>', x, x, height))
        label = f"{at:g}{' ' + unit if unit and not at else ''}"
        anchor = "" if x < LAST_LABEL else Markup(' text-anchor="end"')
        marks.append(html('<text x="{:.2f}%" y="9"{}>{}</text>', x, anchor, label))
        at += step
    return Markup("").join(marks)


def _round_step(step: float) -> float:
    size = 10.0 ** int(f"{step:e}".split("e")[1])
    return next((m * size for m in (1, 2, 5, 10) if m * size >= step), step)
