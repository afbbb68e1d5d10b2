"""Belief map: containers from above, coloured by probability, with the order of search."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize

from dashboards.figures.floor_plan import draw_floor_plan
from dashboards.geometry.marks import dashes
from dashboards.model.containers.container_style import container_colours
from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import run_colour, unit_rgb
from workbench.belief_colours import belief_colours
from workbench.worlds.house import Container
from workbench.worlds.names import readable_name


def draw_belief_map(ax: Axes, timeline: Timeline, scene: Scene, *, scale: bool = True) -> None:
    """Draws the belief at one moment.

    Args:
        scale: whether to draw a colour bar.
    """
    draw_floor_plan(ax, timeline.plan, containers=container_colours(scene) / 255, room_names=False)
    index: dict[str, Container] = {c.id: c for c in timeline.plan.containers}
    for i, stop in enumerate(scene.search_order, 1):
        container = index.get(stop.container)
        if container is not None:
            x, y = container.pose.point
            box = {"boxstyle": "circle,pad=0.2", "facecolor": "white", "edgecolor": "#23262b", "linewidth": 0.5}
            number = ax.text(x, y, str(i), ha="center", va="center", fontsize=5.5, zorder=7, bbox=box)
            number.set_in_layout(False)  # one at a wall would make its map smaller than the others
    ahead = LineCollection(list(dashes(scene.ahead, 0.0)[:, :, :2]), colors=[unit_rgb(run_colour(0))], linewidths=0.9)
    ax.add_collection(ahead).set_zorder(4)
    ax.plot(*scene.trail.T, color=unit_rgb(run_colour(0)), linewidth=1.2, zorder=5)
    ax.plot(scene.robot.x_m, scene.robot.y_m, marker="o", markersize=5, color=unit_rgb(run_colour(0)), zorder=6)
    ax.set_title(f"decision {scene.decision}, {scene.second:.0f} s")
    if scale:
        draw_belief_scale([ax], scene)


def draw_belief_scale(axes: Sequence[Axes], scene: Scene) -> None:
    """Draws one colour bar for several belief maps beside the last; none where nothing was ever believed."""
    if scene.top_belief <= 0:
        return
    table = ListedColormap(belief_colours([i / 255 for i in range(256)]) / 255)
    norm = Normalize(0, 100 * scene.top_belief)
    bar = axes[0].figure.colorbar(
        ScalarMappable(norm=norm, cmap=table), ax=list(axes), shrink=0.5, aspect=18, pad=0.02, format="%.0f %%"
    )
    bar.outline.set_linewidth(0.4)
    bar.set_label(f"belief in {readable_name(scene.focus)}")
