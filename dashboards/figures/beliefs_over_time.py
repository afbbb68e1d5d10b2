"""How did the belief in one item type change from decision to decision? A line for each container that mattered."""

from __future__ import annotations

from matplotlib.axes import Axes

from dashboards.palette import RUNS, unit
from dashboards.timeline import Timeline
from workbench.worlds.names import readable_name

MOST_LINES = 6


def draw_beliefs_over_time(ax: Axes, timeline: Timeline, focus: str) -> None:
    """Probabilities of the containers that were ever most believed, until they were searched."""
    series: dict[str, list[tuple[float, float]]] = {}
    for frame in timeline.decisions:
        if frame.belief is not None and focus in frame.belief.item_types:
            row = frame.belief.probability[frame.belief.item_types.index(focus)]
            for container, p in zip(frame.belief.containers, row, strict=True):
                series.setdefault(container, []).append((timeline.seconds(frame.stamp_ns), 100 * p))
    top = sorted(series, key=lambda c: (-max(p for _, p in series[c]), c))[:MOST_LINES]
    for i, container in enumerate(top):
        x, y = zip(*series[container], strict=True)
        ax.step(
            x, y, where="post", color=unit(RUNS[i % len(RUNS)]), label=_label(container), marker="o", markersize=2
        )
    ax.set_xlabel("time (s)")
    ax.set_ylabel(f"belief in {readable_name(focus)} (%)")
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    if top:
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _label(container: str) -> str:
    """ "dining table 4|1" for DiningTable|4|1."""
    kind, _, which = container.partition("|")
    return f"{readable_name(kind)} {which}".strip()
