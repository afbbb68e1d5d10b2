"""Belief in one item type over the decisions of a run: one line for each container that mattered."""

from __future__ import annotations

from matplotlib.axes import Axes

from dashboards.model.belief_series import belief_series
from dashboards.model.labels import place_words
from dashboards.model.timeline import Timeline
from dashboards.palette import run_colour, unit_rgb
from workbench.worlds.names import readable_name


def draw_beliefs_over_time(ax: Axes, timeline: Timeline, focus: str) -> None:
    """Draws probabilities of the containers that were ever most believed, constant between decisions, until
    searched."""
    found = belief_series(timeline, focus)
    for i, (container, series) in enumerate(found.items()):
        last_ns, last = series[-1]
        held = [*series, (min((d for d in timeline.decision_ns if d > last_ns), default=timeline.end_ns), last)]
        ax.step(
            [timeline.seconds(stamp) for stamp, _ in held],
            [100 * p for _, p in held],
            where="post",
            color=unit_rgb(run_colour(i)),
            label=place_words(container),
            marker="o",
            markersize=2,
            markevery=slice(0, len(series)),
        )
    ax.set_xlabel("time (s)")
    ax.set_ylabel(f"belief in {readable_name(focus)} (%)")
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    if found:
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
