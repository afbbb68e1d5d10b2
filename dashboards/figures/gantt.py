"""Gantt chart of a run: actions as bars over time, one row for each kind, decisions as lines."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from dashboards.model.phases import KINDS, kind_of
from dashboards.model.timeline import Timeline
from dashboards.palette import FAILED, PHASES, css
from workbench.log_schema.events import ActionFinished
from workbench.worlds.names import readable_name

MAX_NAMED = 40
"""The most bars for which each carries its target's name; with more, none does."""


def draw_gantt(ax: Axes, timeline: Timeline) -> None:
    """Draws the run's actions as they happened."""
    actions = timeline.actions
    rows = list(dict.fromkeys(a.action for a in sorted(actions, key=lambda a: (a.start.ns, a.index))))
    for action in actions:
        start, end = timeline.seconds(action.start.ns), timeline.seconds(action.stamp.ns)
        ax.barh(
            rows.index(action.action),
            max(end - start, 0.05),
            left=start,
            height=0.62,
            color=PHASES[kind_of(action)],
            edgecolor="white" if action.success else css(FAILED),
            linewidth=0.5,
            hatch="" if action.support != "imputed" else "////",
        )
        if len(actions) <= MAX_NAMED and (action.action == "move" or not _came_from_a_move(action, actions)):
            ax.text(
                (start + end) / 2,
                rows.index(action.action) - 0.4,
                readable_name(action.target.partition("|")[0]),
                ha="center",
                va="bottom",
                fontsize=4.8,
                rotation=32,
                color="#4a4f57",
            )
    for frame in timeline.decisions:
        ax.axvline(timeline.seconds(frame.stamp_ns), color="#23262b", linewidth=0.4, alpha=0.5, zorder=0)
    ax.set_yticks(range(len(rows)), rows)
    ax.invert_yaxis()
    ax.set_xlim(0, max(timeline.duration_s, 1e-3))
    ax.set_xlabel("time (s)")
    ax.spines["left"].set_visible(False)
    ax.tick_params(axis="y", length=0)
    ax.legend(
        handles=[Patch(color=PHASES[k], label=k) for k in KINDS],
        loc="upper right",
        bbox_to_anchor=(1.0, -0.16),
        ncols=3,
    )


def _came_from_a_move(action: ActionFinished, actions: tuple[ActionFinished, ...]) -> bool:
    """Whether the robot moved there just before: the move's bar then names the place."""
    before = [a for a in actions if a.index < action.index and a.action == "move"]
    return bool(before) and before[-1].target == action.target
