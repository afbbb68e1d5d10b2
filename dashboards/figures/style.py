"""Common style of all figures: sans-serif text, line spacing, thin axes, no frame, fonts that stay text."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes

from dashboards.model.labels import label
from dashboards.model.run_names import run_names
from dashboards.model.timeline import Timeline
from workbench.planning.strategies import PAPER_NAMES

COLUMN_IN = 3.5
"""Width of one column of a two-column paper, in inches."""
PAGE_IN = 7.16
SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["Helvetica", "Arial", "Liberation Sans", "DejaVu Sans"],
    "font.size": 8,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "figure.dpi": 150,
    "savefig.bbox": "tight",
    "savefig.pad_inches": 0.03,
    "svg.fonttype": "none",
    "svg.hashsalt": "lios",
    "pdf.fonttype": 42,
    "text.parse_math": False,
}
"""Names from logs are shown literally: math in them is not parsed."""


@contextmanager
def figure_style() -> Generator[None]:
    """The style, as a context manager."""
    with mpl.rc_context(SETTINGS):
        yield


def as_map(ax: Axes) -> None:
    """Prepares axes for a floor plan: equal scales, no frame or ticks."""
    ax.set_aspect("equal")
    ax.set_axis_off()


def scale_bar(ax: Axes, *, metres: float = 2.0) -> None:
    """Draws a bar of some metres in the lower left corner of a map, its label below, clear of the walls."""
    x, y = ax.get_xlim()[0], ax.get_ylim()[0]
    ax.plot([x, x + metres], [y, y], color="#23262b", linewidth=1.6, solid_capstyle="butt", clip_on=False)
    ax.annotate(
        f"{metres:g} m",
        (x + metres / 2, y),
        xytext=(0, -2),
        textcoords="offset points",
        annotation_clip=False,
        ha="center",
        va="top",
        fontsize=6.5,
    )


def labels_of(timelines: Sequence[Timeline]) -> list[str]:
    """Names that distinguish the runs, as in the dashboard, with strategies as the paper spells them."""
    named: list[str] = []
    for timeline, name in zip(timelines, run_names([t.run for t in timelines]), strict=True):
        ours = timeline.run.info.strategy
        named.append(label(name.replace(ours, PAPER_NAMES.get(ours, ours), 1)))
    return named
