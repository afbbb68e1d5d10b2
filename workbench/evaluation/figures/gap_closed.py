"""A bar chart of the share of the gap between Greedy and the oracle that each policy closes, by kind of item."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes

from workbench.evaluation.figures.style import colour_of


def draw_gap_closed(ax: Axes, rows: Sequence[Mapping[str, Any]], *, title: str) -> None:
    """One bar a policy from Greedy (0) to the oracle (1), with its interval.

    Args:
        rows: of evaluation/search_table.py.
    """
    shown = [
        row for row in rows if row["policy"] not in ("greedy", "oracle") and row["oracle_gap_closed"] is not None
    ]
    for place, row in enumerate(reversed(shown)):
        share, (low, high) = row["oracle_gap_closed"], row["oracle_gap_closed_ci95"]
        ax.barh(place, share, height=0.62, color=colour_of(row["policy"]), alpha=0.85)
        if low is not None and high is not None:
            ax.plot([low, high], [place, place], color="black", linewidth=1.2)
        end = min(max(high or share, share), 1.0)  # the interval of few houses may end far beyond the axis
        ax.text(end + 0.02, place, f"{100 * share:.0f} %", va="center", fontsize=8)
    ax.set_yticks(range(len(shown)), [row["policy"] for row in reversed(shown)], fontsize=8)
    ax.axvline(0, color="#888888", linewidth=0.8)
    ax.axvline(1, color="black", linewidth=0.8)
    ax.set(xlim=(min(-0.02, *(row["oracle_gap_closed"] for row in shown)) if shown else -0.02, 1.08))
    drew = " or ".join(dict.fromkeys(row.get("ci95_resamples", "houses") for row in rows))
    ax.set_xlabel(f"share of the gap, Greedy 0 to oracle 1; 95 % interval over {drew}", fontsize=8)
    ax.set_title(title, fontsize=9)
