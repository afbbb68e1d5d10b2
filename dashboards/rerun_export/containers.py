"""The containers of a run as boxes, coloured by belief over time, and the items that were seen in them."""

from __future__ import annotations

import numpy as np
import rerun as rr

from dashboards.geometry.furniture import MIN_DRAWN_M
from dashboards.model.containers.container_style import belief_fractions, container_colours
from dashboards.model.labels import place_words
from dashboards.model.scene import STATUSES, Scene, scene_at
from dashboards.model.timeline import NEVER, Timeline
from dashboards.palette import FOUND
from dashboards.rerun_export.times import time_columns
from workbench.worlds.house import Container
from workbench.worlds.names import readable_name

LABELLED_SHARE = 0.25
"""A container shows its label unasked from this share of the largest belief of the run."""
ITEM_UP_M, ITEM_APART_M, ITEM_RADIUS_M = 0.12, 0.14, 0.05


def log_containers(recording: rr.RecordingStream, timeline: Timeline) -> None:
    """Write every container's box, its colour and label at each change of knowledge, and what was seen in it."""
    stamps = moments(timeline)
    scenes = [scene_at(timeline, stamp) for stamp in stamps]
    colours = [container_colours(scene) for scene in scenes]
    shares = [belief_fractions(scene) for scene in scenes]
    for i, container in enumerate(timeline.plan.containers):
        path = rr.new_entity_path(["containers", container.id])
        recording.log(path, _box(container), static=True)
        recording.send_columns(
            path,
            time_columns(timeline, stamps),
            rr.Boxes3D.columns(
                colors=np.array([colour[i] for colour in colours], dtype=np.uint8),
                labels=[container_label(container, scene, i) for scene in scenes],
                show_labels=[
                    bool(share[i] >= LABELLED_SHARE) or bool(scene.holds_focus[i])
                    for share, scene in zip(shares, scenes, strict=True)
                ],
            ),
        )
        _log_items(recording, timeline, i)


def moments(timeline: Timeline) -> list[int]:
    """The stamps at which what is known of containers changes, in order."""
    searched = {int(stamp) for stamp in timeline.searched_ns if stamp != NEVER}
    return sorted({timeline.start_ns, *timeline.decision_ns, *searched, timeline.end_ns})


def container_label(container: Container, scene: Scene, index: int) -> str:
    """The container's name with what is known of it: "fridge 1: mug 12.5 %", "fridge 1: searched"."""
    name, belief = place_words(container.id), float(scene.belief[index])
    status = STATUSES[int(scene.status[index])]
    if status != "unsearched":
        return f"{name}: {status}"
    return name if np.isnan(belief) else f"{name}: {readable_name(scene.focus)} {belief:.1%}".replace("%", " %")


def _box(container: Container) -> rr.Boxes3D:
    size = np.maximum(np.array(container.size_m, dtype=np.float64), MIN_DRAWN_M)
    half_turn = container.pose.yaw_rad / 2
    return rr.Boxes3D(
        centers=[(container.pose.x_m, container.pose.y_m, container.base_m + size[2] / 2)],
        half_sizes=[size / 2],
        quaternions=[(0.0, 0.0, np.sin(half_turn), np.cos(half_turn))],
        fill_mode="solid",
    )


def _log_items(recording: rr.RecordingStream, timeline: Timeline, index: int) -> None:
    """The items of a container, in a row over it, from the moment at which they were first seen."""
    container = timeline.plan.containers[index]
    items = timeline.contents.get(container.id, ())
    if not items:
        return
    searched = int(timeline.searched_ns[index])
    seen_ns = timeline.start_ns if timeline.known[index] or searched == NEVER else searched
    top = container.base_m + max(container.size_m[2], MIN_DRAWN_M) + ITEM_UP_M
    along = (np.arange(len(items)) - (len(items) - 1) / 2) * ITEM_APART_M
    count = len(items)
    recording.send_columns(
        rr.new_entity_path(["items", container.id]),
        time_columns(timeline, [seen_ns]),
        rr.Points3D.columns(
            positions=np.column_stack(
                [container.pose.x_m + along, np.full(count, container.pose.y_m), np.full(count, top)]
            ),
            labels=[readable_name(item.type) for item in items],
            colors=np.tile(np.array(FOUND, dtype=np.uint8), (count, 1)),
            radii=np.full(count, ITEM_RADIUS_M),
        ).partition([count]),
    )
