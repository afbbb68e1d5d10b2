"""Draws what a run believes of its containers: colours, bars, marks, and numbers of the order of search.

Each kind is one instanced mesh, so that a change of belief is one array; only what changed is sent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot
from types import MappingProxyType
from typing import final

import numpy as np
import viser

from dashboards.geometry.marks import Mesh, cross, tick, unopened_marker, unseen_marker
from dashboards.geometry.solids import Batch, unit_mesh
from dashboards.model.containers.container_style import (
    MAX_LEFT,
    bar_colours,
    bar_heights_m,
    container_colours,
    left_labels,
)
from dashboards.model.labels import label as label_words
from dashboards.model.scene import STATUSES, Scene
from dashboards.palette import UNOPENED, UNSEEN, Colour, linear_rgb
from dashboards.viser_app.drawing.instances import Instances
from workbench.arrays import Bools, Floats, Uints8
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan
from workbench.worlds.names import readable_name

CROWDED_M, CROWDED_UP_M = 1.3, 0.4
"""Numbers this close to another are raised by this much, to be legible beside it."""
LABELLED = 5
"""How many containers of the intended order of search are numbered in the view."""
MARK_UP_M = 0.04
LEFT_SCALE = 0.72
"""Size of the words over a container that a look may have missed, as a share of a room's name."""
BAR_WIDE_M, MIN_BAR_M = 0.12, 0.01
"""Width of the bar over a container; a lower one is not drawn."""
MARKS: Mapping[str, tuple[Mesh, Colour]] = MappingProxyType(
    {
        "cross": (cross(), (84, 92, 104)),
        "tick": (tick(), (255, 255, 255)),
        "question": (unseen_marker(), UNSEEN),
        "unknown": (unopened_marker(), UNOPENED),
    }
)


@final
class BeliefMarks:
    """The marks of one house.

    Args:
        tops_m: for each container of the plan, the point above which its mark is drawn: (x, y, z).
        furniture: batches whose owned solids take their container's colour, with their handles.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        plan: FloorPlan,
        tops_m: Sequence[tuple[float, float, float]],
        furniture: Sequence[tuple[Batch, viser.BatchedMeshHandle]],
    ) -> None:
        self._scene, self._plan = scene, plan
        self._furniture = [(batch, handle) for batch, handle in furniture if (batch.owner >= 0).any()]
        self._tops = np.array(tops_m, dtype=np.float32).reshape(-1, 3)
        self._index: dict[str, int] = {c.id: i for i, c in enumerate(plan.containers)}
        self._shown: dict[str, object] = {}
        self.numbered: tuple[Point, ...] = ()
        """Where numbers stand now."""
        self.number_labels: tuple[tuple[str, tuple[float, float, float]], ...] = ()
        """The same with their words and heights."""
        count = len(self._tops)
        self._bars = Instances(scene, "/belief/bars", unit_mesh("cylinder"), capacity=count, opacity=0.9)
        self._marks = {
            name: Instances(scene, f"/belief/{name}", mesh, capacity=count) for name, (mesh, _) in MARKS.items()
        }
        self._orders = [
            scene.add_label(f"/belief/order/{i}", "", visible=False, anchor="bottom-center", font_screen_scale=1.0)
            for i in range(LABELLED)
        ]
        self._left: list[viser.LabelHandle] = []

    def show(self, scenes: Sequence[Scene], unopened: Bools, *, bars: bool = True, orders: bool = True) -> None:
        """Shows a moment: the beliefs of the first scene; of every scene, where a replay had to end.

        Args:
            unopened: containers that none of the runs opened, bool (n,).
        """
        scene = scenes[0]
        height_m = bar_heights_m(scene) if bars else np.zeros(len(self._tops))
        self._show_colours(container_colours(scene), bar_colours(scene), height_m)
        self._show_marks(scenes, unopened)
        self._show_orders(scene, height_m, wanted=orders)
        self._show_left(left_labels(scene) if bars else ())

    def remove(self) -> None:
        for part in (self._bars, *self._marks.values(), *self._orders, *self._left):
            part.remove()

    def _show_colours(self, of_owner: Uints8, of_bar: Uints8, height_m: Floats) -> None:
        if self._changed("colours", of_owner):
            for batch, handle in self._furniture:
                handle.batched_colors = linear_rgb(batch.coloured(of_owner))
        if self._changed("bars", np.column_stack([height_m, of_bar])):
            drawn = height_m > MIN_BAR_M
            tall, wide = height_m[drawn], np.full(int(drawn.sum()), BAR_WIDE_M)
            self._bars.show(
                (self._tops[drawn] + np.outer(tall / 2, [0, 0, 1])).astype(np.float32),
                linear_rgb(of_bar[drawn]),
                scales=np.column_stack([wide, wide, tall]).astype(np.float32),
            )

    def _show_marks(self, scenes: Sequence[Scene], unopened: Bools) -> None:
        scene = scenes[0]
        searched = scene.status == STATUSES.index("searched")
        seen = searched | (scene.status == STATUSES.index("known"))
        unseen = np.any([s.unseen for s in scenes if len(s.unseen) == len(scene.unseen)], axis=0)
        for name, mask in (
            ("cross", searched & ~scene.holds_focus),
            ("tick", seen & scene.holds_focus),
            ("question", unseen),
            ("unknown", unopened & ~unseen),
        ):
            if self._changed(name, mask):
                paint = np.tile(np.array(MARKS[name][1], dtype=np.uint8), (int(mask.sum()), 1))
                up = np.array([0.0, 0.0, MARK_UP_M], dtype=np.float32)
                self._marks[name].show(self._tops[mask] + up, linear_rgb(paint))

    def _show_orders(self, scene: Scene, height_m: Floats, *, wanted: bool) -> None:
        """Numbers over the containers to come; the first also says what it is."""
        stops = scene.search_order[:LABELLED] if wanted else ()
        at = [self._index.get(stop.container) for stop in stops]
        if not self._changed("orders", [(i, 0.0 if i is None else float(height_m[i])) for i in at]):
            return
        taken: list[Point] = []
        labels: list[tuple[str, tuple[float, float, float]]] = []
        for place, label in enumerate(self._orders):
            i = at[place] if place < len(at) else None
            label.visible = i is not None
            if i is None:
                continue
            x, y, z = (float(v) for v in self._tops[i])
            kind = f". {label_words(readable_name(self._plan.containers[i].type))}" if place == 0 else ""
            label.text = f"{place + 1}{kind}"
            near = sum(hypot(x - a, y - b) < CROWDED_M for a, b in taken)
            at_m = (x, y, z + 0.15 + float(height_m[i]) + CROWDED_UP_M * near)
            label.position = at_m
            taken.append((x, y))
            labels.append((label.text, at_m))
        self.numbered, self.number_labels = tuple(taken), tuple(labels)

    def _show_left(self, words: Sequence[tuple[int, str]]) -> None:
        """What is left of the belief where a look may have missed, in words below the top of the container."""
        if not self._changed("left", words):
            return
        while len(self._left) < min(len(words), MAX_LEFT):
            name = f"/belief/left/{len(self._left)}"
            self._left.append(self._scene.add_label(name, "", anchor="top-center", font_screen_scale=LEFT_SCALE))
        for place, label in enumerate(self._left):
            label.visible = place < len(words)
            if label.visible:
                i, label.text = words[place]
                x, y, z = (float(v) for v in self._tops[i])
                label.position = (x, y, z)

    def _changed(self, name: str, value: object) -> bool:
        """Whether a value differs from what was sent last; stores it."""
        before = self._shown.get(name)
        if isinstance(value, np.ndarray):
            same = isinstance(before, np.ndarray) and np.array_equal(before, value)
        else:
            same = before == value
        self._shown[name] = value
        return not same
