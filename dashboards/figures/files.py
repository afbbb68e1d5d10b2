"""Writes all figures of some runs into a folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dashboards.figures.belief_map import draw_belief_map, draw_belief_scale
from dashboards.figures.beliefs_over_time import draw_beliefs_over_time
from dashboards.figures.comparison import draw_comparison
from dashboards.figures.cost_over_time import MAX_INSIDE_LEGEND, draw_cost_over_time
from dashboards.figures.gantt import draw_gantt
from dashboards.figures.style import COLUMN_IN, PAGE_IN, figure_style
from dashboards.figures.trajectory import draw_trajectory
from dashboards.model.scene import scene_at
from dashboards.model.timeline import Timeline
from workbench.errors import BadValue, OutputExists
from workbench.evaluation.figures.style import save_whole
from workbench.files import make_folder

FORMATS = ("pdf", "svg", "png")
KEY_LINE_IN = 0.15
"""Height of one line of a legend below a figure."""
MAPS = 3
"""Number of moments with a belief map, from the first decision to the last."""


def write_figures(
    timelines: Sequence[Timeline], folder: Path, *, formats: Sequence[str] = ("pdf", "png"), force: bool = False
) -> list[Path]:
    """Draws every figure that the runs have the data for; returns the files written.

    Raises:
        BadValue: a format that is not one of FORMATS.
        OutputExists: a file is there and force is not given.
    """
    for name in formats:
        if name not in FORMATS:
            raise BadValue("--format", name, "one of " + ", ".join(FORMATS))
    drawings = _drawings(timelines)
    paths = [folder / f"{name}.{ext}" for name in drawings for ext in formats]
    for path in paths:
        if path.exists() and not force:
            raise OutputExists(path)
    make_folder(folder)
    with mpl.rc_context({"backend": "agg"}), figure_style():
        for name, draw in drawings.items():
            figure = draw()
            for ext in formats:
                save_whole(figure, folder / f"{name}.{ext}", dpi=300, metadata=_metadata(ext))
    return paths


def _drawings(timelines: Sequence[Timeline]) -> dict[str, Callable[[], Figure]]:
    first = timelines[0]
    focus = scene_at(first, first.decision_ns[0] if first.decisions else first.start_ns).focus
    below_in = KEY_LINE_IN * (len(timelines) + 1) if len(timelines) > MAX_INSIDE_LEGEND else 0.0
    made: dict[str, Callable[[], Figure]] = {
        "trajectory": lambda: _one(PAGE_IN * 0.7, PAGE_IN * 0.6, lambda ax: draw_trajectory(ax, timelines)),
        "cost_over_time": lambda: _one(COLUMN_IN, 2.4 + below_in, lambda ax: draw_cost_over_time(ax, timelines)),
    }
    if first.actions:
        made["plan"] = lambda: _one(PAGE_IN, 2.2, lambda ax: draw_gantt(ax, first))
    if focus:
        made["belief_maps"] = lambda: _belief_maps(first, focus)
        made["belief_over_time"] = lambda: _one(COLUMN_IN, 2.2, lambda ax: draw_beliefs_over_time(ax, first, focus))
    if len(timelines) > 1:
        made["comparison"] = lambda: _one(
            COLUMN_IN, 0.8 + 0.3 * len(timelines), lambda ax: draw_comparison(ax, timelines)
        )
    return made


def _one(width_in: float, height_in: float, draw: Callable[[Axes], None]) -> Figure:
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    draw(figure.subplots())
    return figure


def _belief_maps(timeline: Timeline, focus: str) -> Figure:
    """Maps of the belief in one item side by side, on one colour scale, for the time in which it was believed to be
    anywhere.

    The order of search is shown where it is the order for that item.
    """
    stamps = [d.stamp_ns for d in timeline.decisions if d.belief is not None and focus in d.belief.item_types]
    chosen = sorted({stamps[round(i * (len(stamps) - 1) / max(1, MAPS - 1))] for i in range(MAPS)})
    # Compressed: maps keep their aspect ratio, and plain constrained layout would leave gaps of different widths.
    figure = Figure(figsize=(PAGE_IN, PAGE_IN / len(chosen) * 0.95), layout="compressed")
    axes = figure.subplots(1, len(chosen), squeeze=False)[0]
    scenes = [scene_at(timeline, stamp, focus=focus) for stamp in chosen]
    for ax, scene in zip(axes, scenes, strict=True):
        is_order_for_it = scene_at(timeline, scene.stamp_ns).focus == focus
        draw_belief_map(ax, timeline, scene if is_order_for_it else replace(scene, search_order=()), scale=False)
    draw_belief_scale(axes, scenes[-1])
    return figure


def _metadata(ext: str) -> dict[str, str | None]:
    """File metadata without dates, so that the same runs give the same bytes."""
    dated: dict[str, str | None] = {{"pdf": "CreationDate", "svg": "Date"}.get(ext, "Software"): None}
    return dated
