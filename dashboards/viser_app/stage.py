"""Shows a house once and then one scene after another to one browser, sending only what changed.

Everything lives in the client's own scene, so that two tabs never disturb one another. A house is three instanced
meshes, a handful of floors and two versions of its walls; a change of belief is one array of colours.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from dashboards.geometry.house import HouseShape
from dashboards.geometry.marks import (
    ROBOT_DARK,
    cross,
    dashes,
    question,
    robot_body,
    robot_legs,
    tick,
    unknown,
    walked,
)
from dashboards.geometry.occupancy import occupancy_mesh
from dashboards.geometry.solids import Batch, unit_mesh
from dashboards.looks import bar_heights_m, container_colours
from dashboards.palette import OCCUPIED, UNOPENED, UNSEEN, Colour
from dashboards.scene import STATUSES, Scene
from workbench.worlds.house import FloorPlan
from workbench.worlds.names import readable_name
from workbench.worlds.occupancy import OccupancyGrid

TRAIL_M = 0.02
"""Height of trails above the floor; the run in focus lies on top."""
SHADE = 0.07
"""Opacity of one layer of the shade under furniture; three lie over each other."""
TOGETHER_M = 0.5
"""A ghost so close to the run in focus is not labelled: their names would lie over each other."""
CROWDED_M, CROWDED_UP_M = 1.3, 0.4
"""Numbers so close to another are raised by so much, to be read beside it."""
LABELLED = 5
"""How many containers of the intended order of search are numbered in the view."""


@dataclass(slots=True)
class RunActor:
    """What moves for one run: robot, way behind, way ahead, label."""

    frame: viser.FrameHandle
    trail: viser.LineSegmentsHandle
    ahead: viser.LineSegmentsHandle
    label: viser.LabelHandle
    height_m: float
    shown: dict[str, Any] = field(default_factory=dict)


class Stage:
    """One browser's view of one house."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._scene = client.scene
        self._plan: FloorPlan | None = None
        self._shape: HouseShape | None = None
        self._furniture: list[tuple[Batch, viser.BatchedMeshHandle]] = []
        self._handles: list[viser.SceneNodeHandle] = []
        self._walls: dict[str, list[viser.SceneNodeHandle]] = {}
        self._rooms: list[viser.LabelHandle] = []
        self._occupancy: viser.MeshHandle | None = None
        self._bars: viser.BatchedMeshHandle | None = None
        self._marks: dict[str, viser.BatchedMeshHandle] = {}
        self._orders: list[viser.LabelHandle] = []
        self._actors: list[RunActor] = []
        self._shown: dict[str, Any] = {}

    def light(self) -> None:
        """Daylight without a lamp in sight: a bright sky, a warm sun from the south-west, a weak one against it."""
        scene = self._scene
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere(
            "/light/sky", sky_color=(250, 252, 255), ground_color=(190, 184, 176), intensity=1.9
        )
        scene.add_light_directional("/light/sun", color=(255, 246, 232), intensity=1.7, position=(-6.0, -9.0, 14.0))
        scene.add_light_directional("/light/fill", color=(226, 236, 255), intensity=0.5, position=(9.0, 6.0, 6.0))

    def show_house(self, plan: FloorPlan, shape: HouseShape, grid: OccupancyGrid | None = None) -> None:
        """Replaces what is shown by an empty house, with its occupancy grid as a layer."""
        self.clear()
        cells = occupancy_mesh(grid) if grid is not None else None
        if cells is not None:
            self._occupancy = self._keep(
                self._scene.add_mesh_simple(
                    "/house/occupancy", *cells, color=OCCUPIED, opacity=0.45, side="double", cast_shadow=False
                )
            )
            self._occupancy.visible = False
        self._plan, self._shape = plan, shape
        for floor in shape.floors:
            self._keep(
                self._scene.add_mesh_simple(
                    f"/house/floors/{len(self._handles)}",
                    floor.vertices,
                    floor.faces,
                    color=floor.colour,
                    side="double",
                    cast_shadow=False,
                )
            )
            label = self._scene.add_label(
                f"/house/rooms/{len(self._rooms)}",
                readable_name(floor.kind),
                position=(*floor.label_at, 0.05),
                font_screen_scale=0.85,
                anchor="center-center",
            )
            self._rooms.append(label)
            self._keep(label)
        self._walls = {
            "cut": [self._batch("/house/walls/cut", b) for b in shape.cut_walls],
            "whole": [self._batch("/house/walls/whole", b, visible=False) for b in shape.whole_walls],
        }
        self._furniture = [(b, self._batch("/house/furniture", b)) for b in shape.furniture]
        self._walls["whole"] += [self._batch("/house/hung", b, visible=False) for b in shape.hung]
        for batch in shape.shadows:
            self._batch("/house/shadows", batch, opacity=SHADE)
        self._add_bars_and_marks(shape)

    def show_walls(self, mode: str) -> None:
        """Cut away, whole, or none."""
        for name, handles in self._walls.items():
            for handle in handles:
                handle.visible = name == mode

    def show_occupancy(self, visible: bool) -> None:
        if self._occupancy is not None:
            self._occupancy.visible = visible

    def show_room_names(self, visible: bool) -> None:
        for label in self._rooms:
            label.visible = visible

    def cast(self, colours: list[Colour], names: list[str], here: list[bool]) -> None:
        """Makes as many actors as there are runs, in their colours; the first is in focus.

        Args:
            here: whether a run is of the place that is shown; others are not drawn into it.
        """
        for actor in self._actors:
            for node in (actor.frame, actor.trail, actor.ahead):
                node.remove()
        self._actors = [self._actor(i, colour, names[i]) for i, colour in enumerate(colours)]
        for actor, visible in zip(self._actors, here, strict=True):
            for node in (actor.frame, actor.trail, actor.ahead):
                node.visible = visible

    def show(
        self, scenes: list[Scene], unopened: npt.NDArray[np.bool_], *, bars: bool = True, orders: bool = True
    ) -> None:
        """Shows one moment: beliefs and marks of the first scene, robots and ways of all.

        Args:
            unopened: containers that none of the runs opened, bool (n,).
        """
        with self._client.atomic():
            if scenes and self._shape is not None:
                self._show_beliefs(scenes[0], bars=bars)
                self._show_marks(scenes, unopened)
                self._show_orders(scenes[0] if orders else None)
            for actor, scene in zip(self._actors, scenes, strict=False):
                self._show_run(actor, scene)
                if actor is not self._actors[0]:
                    apart = hypot(scene.robot.x_m - scenes[0].robot.x_m, scene.robot.y_m - scenes[0].robot.y_m)
                    actor.label.visible = actor.frame.visible and apart > TOGETHER_M

    def clear(self) -> None:
        """Removes everything of the house and its runs."""
        self.cast([], [], [])
        for handle in self._handles:
            handle.remove()
        for label in self._orders:
            label.remove()
        self._handles, self._rooms, self._orders, self._furniture = [], [], [], []
        self._occupancy = None
        self._walls, self._marks, self._shown, self._bars = {}, {}, {}, None

    def _keep(self, handle: Any) -> Any:
        self._handles.append(handle)
        return handle

    def _batch(
        self, name: str, batch: Batch, *, visible: bool = True, opacity: float | None = None
    ) -> viser.BatchedMeshHandle:
        vertices, faces = unit_mesh(batch.shape)
        return self._keep(
            self._scene.add_batched_meshes_simple(
                f"{name}/{batch.shape}",
                vertices,
                faces,
                batched_wxyzs=batch.wxyz(),
                batched_positions=batch.centre,
                batched_scales=batch.size_m,
                batched_colors=batch.colour,
                lod="off",
                flat_shading=batch.shape == "box",
                cast_shadow=False,
                receive_shadow=False,
                visible=visible,
                opacity=opacity,
            )
        )

    def _add_bars_and_marks(self, shape: HouseShape) -> None:
        count = len(shape.tops_m)
        if not count:
            return
        upright = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (count, 1))
        at = np.array(shape.tops_m, dtype=np.float32)
        nothing = np.full((count, 3), 1e-4, dtype=np.float32)
        box = unit_mesh("cylinder")
        self._bars = self._keep(
            self._scene.add_batched_meshes_simple(
                "/belief/bars", *box, upright, at, batched_scales=nothing, lod="off", cast_shadow=False, opacity=0.9
            )
        )
        for name, mesh, colour in (
            ("cross", cross(), (84, 92, 104)),
            ("tick", tick(), (255, 255, 255)),
            ("question", question(), UNSEEN),
            ("unknown", unknown(), UNOPENED),
        ):
            self._marks[name] = self._keep(
                self._scene.add_batched_meshes_simple(
                    f"/belief/{name}",
                    *mesh,
                    upright,
                    at + np.array([0, 0, 0.04], dtype=np.float32),
                    batched_scales=nothing,
                    batched_colors=colour,
                    lod="off",
                    flat_shading=True,
                    cast_shadow=False,
                )
            )
        self._orders = [
            self._scene.add_label(
                f"/belief/order/{i}", "", visible=False, anchor="bottom-center", font_screen_scale=1.0
            )
            for i in range(LABELLED)
        ]

    def _show_beliefs(self, scene: Scene, *, bars: bool) -> None:
        of_owner = container_colours(scene)
        if self._changed("colours", of_owner):
            for batch, handle in self._furniture:
                if (batch.owner >= 0).any():
                    handle.batched_colors = batch.coloured(of_owner)
        height = bar_heights_m(scene) * (1.0 if bars else 0.0)
        if self._bars is not None and self._changed("bars", height):
            assert self._shape is not None
            tops = np.array(self._shape.tops_m, dtype=np.float32)
            thin = np.where(height > 0.01, 0.12, 1e-4)
            self._bars.batched_scales = np.column_stack([thin, thin, np.maximum(height, 1e-4)]).astype(np.float32)
            self._bars.batched_positions = (tops + np.outer(height / 2, [0, 0, 1])).astype(np.float32)
            self._bars.batched_colors = of_owner

    def _show_marks(self, scenes: list[Scene], unopened: npt.NDArray[np.bool_]) -> None:
        """Marks of the run in focus; where a replay had to end, of every run; and what nobody opened."""
        scene = scenes[0]
        unseen = np.any([s.unseen for s in scenes if len(s.unseen) == len(scene.unseen)], axis=0)
        seen = (scene.status == STATUSES.index("searched")) | (scene.status == STATUSES.index("known"))
        for name, mask in (
            ("cross", (scene.status == STATUSES.index("searched")) & ~scene.holds_focus),
            ("tick", seen & scene.holds_focus),
            ("question", unseen),
            ("unknown", unopened & ~unseen),
        ):
            if name in self._marks and self._changed(name, mask):
                self._marks[name].batched_scales = (
                    np.where(mask[:, None], 1.0, 1e-4).repeat(3, axis=1).astype(np.float32)
                )

    def _show_orders(self, scene: Scene | None) -> None:
        stops = scene.search_order[:LABELLED] if scene is not None else ()
        words = [(s.container, f"{i + 1}") for i, s in enumerate(stops)]
        if self._plan is None or self._shape is None or not self._changed("orders", words):
            return
        index = {c.id: i for i, c in enumerate(self._plan.containers)}
        height = bar_heights_m(scene) if scene is not None else np.zeros(0)
        taken: list[tuple[float, float]] = []
        for label, stop in zip(self._orders, [*words, *[None] * LABELLED], strict=False):
            at = index.get(stop[0]) if stop is not None else None
            label.visible = at is not None
            if at is not None and stop is not None:
                x, y, z = self._shape.tops_m[at]
                first = stop is words[0]
                label.text = f"{stop[1]}. {readable_name(self._plan.containers[at].type)}" if first else stop[1]
                near = sum(hypot(x - a, y - b) < CROWDED_M for a, b in taken)
                taken.append((x, y))
                label.position = (x, y, z + 0.15 + float(height[at]) + CROWDED_UP_M * near)

    def _actor(self, index: int, colour: Colour, name: str) -> RunActor:
        root = f"/runs/{index}"
        ghost = 0.4 if index else None
        frame = self._scene.add_frame(f"{root}/robot", show_axes=False)
        for part, mesh, paint in (("body", robot_body(), colour), ("legs", robot_legs(), ROBOT_DARK)):
            self._scene.add_mesh_simple(
                f"{root}/robot/{part}", *mesh, color=paint, flat_shading=True, opacity=ghost, cast_shadow=not index
            )
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        height = TRAIL_M + 0.012 * max(1, 6 - index)
        thick = 0.05 if index == 0 else 0.035
        return RunActor(
            frame=frame,
            trail=self._scene.add_line_segments(f"{root}/trail", nothing, colour, thickness=thick),
            ahead=self._scene.add_line_segments(f"{root}/ahead", nothing, colour, thickness=thick * 0.7),
            label=self._scene.add_label(
                f"{root}/robot/label",
                name,
                position=(0, 0, 0.95 + 0.35 * index),
                anchor="bottom-center",
                font_screen_scale=0.8,
            ),
            height_m=height,
        )

    def _show_run(self, actor: RunActor, scene: Scene) -> None:
        robot = scene.robot
        pose = (robot.x_m, robot.y_m, robot.yaw_rad)
        if actor.shown.get("pose") != pose:
            actor.frame.position = (robot.x_m, robot.y_m, 0.0)
            actor.frame.wxyz = (cos(robot.yaw_rad / 2), 0.0, 0.0, sin(robot.yaw_rad / 2))
            actor.shown["pose"] = pose
            _set_points(actor.trail, walked(scene.trail, scene.imputed, actor.height_m))
        ahead = dashes(scene.ahead, actor.height_m + 0.004)
        if not np.array_equal(actor.shown.get("ahead"), ahead):
            _set_points(actor.ahead, ahead)
            actor.shown["ahead"] = ahead

    def _changed(self, name: str, value: Any) -> bool:
        """Whether a thing differs from what was sent last; remembers it."""
        before = self._shown.get(name)
        if isinstance(value, np.ndarray):
            same = isinstance(before, np.ndarray) and np.array_equal(before, value)
        else:
            same = before == value
        self._shown[name] = value
        return not same


def _set_points(handle: viser.LineSegmentsHandle, points: npt.NDArray[np.float32]) -> None:
    handle.points = points if len(points) else np.zeros((1, 2, 3), dtype=np.float32)
