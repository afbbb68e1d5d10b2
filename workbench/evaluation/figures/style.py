"""The style of figures: colour-blind-safe colours (Okabe and Ito, 2008), and one font size."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.files import write_atomically

BLUE, VERMILION, GREEN, PINK, ORANGE, SKY, GREY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#5A5A5A",
)

POLICY_COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "greedy": GREY,
        "most-probable": PINK,
        "lios": ORANGE,
        "conditioned-lios": BLUE,
        "marginal-lios": SKY,
        "full-lios": GREEN,
        "oracle": "#000000",
    }
)

DOTS_PER_INCH = 150


def colour_of(policy: str) -> str:
    return POLICY_COLOURS.get(policy, VERMILION)


def new_figure(width_in: float, height_in: float, *, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """A new figure with its axes side by side, without a window."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    axes = [figure.add_subplot(1, columns, i + 1) for i in range(columns)]
    for ax in axes:
        ax.spines[["top", "right"]].set_visible(False)
    return figure, axes


def disable_math_text(ax: Axes) -> None:
    """Disable math mode in all texts, since names of strategies and files may contain dollar signs."""
    legend = ax.get_legend()
    labels = [*ax.get_xticklabels(), ax.xaxis.label, ax.yaxis.label, *(legend.get_texts() if legend else ())]
    for label in labels:
        label.set_parse_math(False)


def save(figure: Figure, path: Path) -> Path:
    """Write a PNG whose bytes depend only on the drawing."""
    return save_whole(figure, path, dpi=DOTS_PER_INCH, metadata={"Software": None})


def save_whole(figure: Figure, path: Path, *, dpi: float | None = None, metadata: dict[str, Any]) -> Path:
    """Write a figure of the path's kind, or nothing where it finds no room."""
    stream = BytesIO()
    figure.savefig(stream, format=path.suffix.removeprefix("."), dpi=dpi or "figure", metadata=metadata)
    write_atomically(path, stream.getvalue())
    return path
