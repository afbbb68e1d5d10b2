"""Draws what a run believes of its containers: colours, bars, marks, and numbers of the order of search.

Each kind is one instanced mesh, so that a change of belief is one array; only what changed is sent.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import final

import numpy as np
import viser

from dashboards.geometry.marks import cross, tick, unopened_marker, unseen_marker
from dashboards.geometry.solids import Batch, unit_mesh
from dashboards.model.containers.container_style import bar_heights_m, container_colours
from dashboards.model.labels import label as label_words
from dashboards.model.scene import STATUSES, Scene
from dashboards.palette import UNOPENED, UNSEEN, linear_rgb
from workbench.arrays import Bools, Floats, Floats32, Uints8, Uints32
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan
from workbench.worlds.names import readable_name

CROWDED_M, CROWDED_UP_M = 1.3, 0.4
"""Numbers this close to another are raised by this much, to be legible beside it."""
LABELLED = 5
"""How many containers of the intended order of search are numbered in the view."""
MARK_UP_M = 0.04
SPECK = 1e-4
"""The scale of invisible instances; viewers do not accept 0."""


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
        up = np.array([0.0, 0.0, MARK_UP_M], dtype=np.float32)
        self._bars = self._mesh("bars", unit_mesh("cylinder"), self._tops, opacity=0.9)
        self._marks = {
            name: handle
            for name, mesh, colour in (
                ("cross", cross(), (84, 92, 104)),
                ("tick", tick(), (255, 255, 255)),
                ("question", unseen_marker(), UNSEEN),
                ("unknown", unopened_marker(), UNOPENED),
            )
            if (handle := self._mesh(name, mesh, self._tops + up, colour=colour)) is not None
        }
        self._orders = [
            scene.add_label(f"/belief/order/{i}", "", visible=False, anchor="bottom-center", font_screen_scale=1.0)
            for i in range(LABELLED)
        ]

    def show(self, scenes: Sequence[Scene], unopened: Bools, *, bars: bool = True, orders: bool = True) -> None:
        """Shows a moment: the beliefs of the first scene; of every scene, where a replay had to end.

        Args:
            unopened: containers that none of the runs opened, bool (n,).
        """
        scene = scenes[0]
        height_m = bar_heights_m(scene) if bars else np.zeros(len(self._tops))
        self._show_colours(container_colours(scene), height_m)
        self._show_marks(scenes, unopened)
        self._show_orders(scene, height_m, wanted=orders)

    def remove(self) -> None:
        for handle in (*([self._bars] if self._bars is not None else []), *self._marks.values(), *self._orders):
            handle.remove()

    def _mesh(
        self,
        name: str,
        mesh: tuple[Floats32, Uints32],
        at: Floats32,
        *,
        colour: tuple[int, int, int] | None = None,
        opacity: float | None = None,
    ) -> viser.BatchedMeshHandle | None:
        """One instance for each container, too small to be seen yet; None for a place without containers."""
        if not len(at):
            return None
        return self._scene.add_batched_meshes_simple(
            f"/belief/{name}",
            *mesh,
            np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(at), 1)),
            at,
            batched_scales=np.full((len(at), 3), SPECK, dtype=np.float32),
            batched_colors=linear_rgb(np.array(colour, dtype=np.uint8)) if colour is not None else (90, 200, 255),
            lod="off",
            flat_shading=colour is not None,
            cast_shadow=False,
            opacity=opacity,
        )

    def _show_colours(self, of_owner: Uints8, height_m: Floats) -> None:
        if self._changed("colours", of_owner):
            for batch, handle in self._furniture:
                handle.batched_colors = linear_rgb(batch.coloured(of_owner))
            if self._bars is not None:
                self._bars.batched_colors = linear_rgb(of_owner)
        if self._bars is not None and self._changed("bars", height_m):
            thin = np.where(height_m > 0.01, 0.12, SPECK)
            self._bars.batched_scales = np.column_stack([thin, thin, np.maximum(height_m, SPECK)]).astype(np.float32)
            self._bars.batched_positions = (self._tops + np.outer(height_m / 2, [0, 0, 1])).astype(np.float32)

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
            handle = self._marks.get(name)
            if handle is not None and self._changed(name, mask):
                handle.batched_scales = np.where(mask[:, None], 1.0, SPECK).repeat(3, axis=1).astype(np.float32)

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

    def _changed(self, name: str, value: object) -> bool:
        """Whether a value differs from what was sent last; stores it."""
        before = self._shown.get(name)
        if isinstance(value, np.ndarray):
            same = isinstance(before, np.ndarray) and np.array_equal(before, value)
        else:
            same = before == value
        self._shown[name] = value
        return not same
