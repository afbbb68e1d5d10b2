"""The scene of one browser: shows a house once and then one moment after another, sending only what changed.

Everything is in the client's own scene, so that tabs are independent of each other. A house is three instanced
meshes, a handful of floors and two versions of its walls; a change of belief is one array of colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import viser

from dashboards.geometry.floors import Floor
from dashboards.geometry.goal_places import goal_frames
from dashboards.geometry.house import HouseShape
from dashboards.geometry.lit.daylight import GROUND, LAMPS, SKY, SKY_INTENSITY
from dashboards.geometry.lit.glb import Layer, glb
from dashboards.geometry.lit.lit_mesh import lit_floors, lit_mesh, lit_solids, lit_tops, merged
from dashboards.geometry.marks import Mesh
from dashboards.geometry.occupancy import occupancy_mesh
from dashboards.geometry.room_names import PictureView, Point3, label_box, room_name_places
from dashboards.geometry.solids import Batch, unit_mesh
from dashboards.geometry.walls import CUT_AWAY_M
from dashboards.model.containers.item_marks import ItemMarks
from dashboards.model.labels import label as label_words
from dashboards.model.scene import Scene
from dashboards.palette import GOAL, OCCUPIED, Colour, linear_rgb
from dashboards.viser_app.drawing.actors import Actors
from dashboards.viser_app.drawing.belief_marks import BeliefMarks
from dashboards.viser_app.drawing.item_layer import ItemLayer
from workbench.arrays import Bools
from workbench.log_schema.place import Place
from workbench.planning.tasks import Task
from workbench.worlds.geometry import Point
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.names import readable_name

WALL_M = {"cut": CUT_AWAY_M, "whole": 2.7, "none": 0.0}
"""How high walls are taken to be, by how they are shown."""
SHADE = 0.07
"""Opacity of one layer of the shade under furniture; three are stacked."""


@final
class Stage:
    """One browser's view of one house."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._scene = client.scene
        self._handles: list[viser.SceneNodeHandle] = []
        self._walls: dict[str, viser.GlbHandle] = {}
        self._shape: HouseShape | None = None
        self._rooms: list[viser.LabelHandle] = []
        self._floors: tuple[Floor, ...] = ()
        self._named_items: tuple[tuple[str, Point3], ...] = ()
        self._rooms_shown: object = None
        self._occupancy: viser.MeshHandle | None = None
        self._marks: BeliefMarks | None = None
        self._items: ItemLayer | None = None
        self._actors = Actors(client.scene)

    def light(self) -> None:
        """Daylight without a visible lamp: a bright sky, a warm sun from the south-west, a weak light against it."""
        scene = self._scene
        scene.configure_default_lights(enabled=False)
        scene.configure_environment_map(None)
        scene.add_light_hemisphere("/light/sky", sky_color=SKY, ground_color=GROUND, intensity=SKY_INTENSITY)
        for lamp in LAMPS:
            scene.add_light_directional(
                f"/light/{lamp.name}", color=lamp.colour, intensity=lamp.intensity, position=lamp.position
            )

    def show_house(self, place: Place, task: Task, shape: HouseShape) -> None:
        """Replaces what is shown by an empty house, its occupancy grid as a layer, the goal's places framed."""
        self.clear()
        self._shape = shape
        self._add_occupancy(place.occupancy)
        self._add_fixed(shape, goal_frames(place, task))
        self._add_room_names(shape)
        furniture = [
            (owned, self._batch("/house/furniture", owned))
            for batch in shape.furniture
            if len((owned := batch.where(batch.owner >= 0)).owner)
        ]
        self._marks = BeliefMarks(self._scene, place.plan, shape.tops_m, furniture)
        self._items = ItemLayer(self._scene)

    def show_walls(self, mode: str) -> None:
        """Cut away, whole, or none; whole ones are sent when they are first asked for."""
        if self._shape is None:
            return
        if mode == "whole" and mode not in self._walls:
            self._add_walls(mode, (*self._shape.whole_walls, *self._shape.hung))
        for name, handle in self._walls.items():
            handle.visible = name == mode

    def show_occupancy(self, visible: bool) -> None:
        if self._occupancy is not None:
            self._occupancy.visible = visible

    def show_room_names(self, view: PictureView | None, walls: str) -> None:
        """Shows the names of rooms where numbers and items leave room for them; without a view none."""
        marks = (self._marks.number_labels if self._marks is not None else (), self._named_items)
        wanted = (view, walls, *marks)
        if wanted == self._rooms_shown:
            return
        self._rooms_shown = wanted
        places: list[Point | None] = [None] * len(self._rooms)
        if view is not None:
            boxes = [label_box(at, words, view) for named in marks for words, at in named]
            places = room_name_places(
                self._floors,
                [label.text for label in self._rooms],
                view,
                wall_m=WALL_M[walls],
                taken=[box for box in boxes if box is not None],
            )
        with self._client.atomic():
            for label, place in zip(self._rooms, places, strict=True):
                if place is not None and tuple(label.position[:2]) != place:
                    label.position = (*place, 0.05)
                if label.visible != (place is not None):
                    label.visible = place is not None

    def set_runs(self, colours: Sequence[Colour], names: Sequence[str], here: Sequence[bool]) -> None:
        """Creates as many actors as there are runs, in their colours; the first is in focus.

        Args:
            here: for each run, whether it is of the place that is shown; others are not drawn.
        """
        self._actors.set_runs(colours, names, here)

    def show(self, scenes: Sequence[Scene], unopened: Bools, *, bars: bool = True, orders: bool = True) -> None:
        """Shows one moment: beliefs and marks of the first scene, robots and paths of all.

        Args:
            unopened: containers that none of the runs opened, bool (n,).
        """
        if self._marks is None or not scenes:
            return
        with self._client.atomic():
            self._marks.show(scenes, unopened, bars=bars, orders=orders)
            self._actors.show(scenes, self._marks.numbered)

    def show_items(self, marks: ItemMarks) -> None:
        """Shows the items that were seen."""
        if self._items is not None:
            self._named_items = marks.names
            with self._client.atomic():
                self._items.show(marks)

    def clear(self) -> None:
        """Removes everything of the house and its runs."""
        self._actors.set_runs([], [], [])
        if self._marks is not None:
            self._marks.remove()
        if self._items is not None:
            self._items.remove()
        for handle in self._handles:
            handle.remove()
        self._handles, self._rooms, self._walls, self._shape = [], [], {}, None
        self._floors, self._named_items, self._rooms_shown = (), (), None
        self._occupancy, self._marks, self._items = None, None, None

    def _add_occupancy(self, grid: OccupancyGrid | None) -> None:
        cells = occupancy_mesh(grid) if grid is not None else None
        if cells is None:
            return
        self._occupancy = self._scene.add_mesh_simple(
            "/house/occupancy", *cells, color=OCCUPIED, opacity=0.45, side="double", cast_shadow=False, visible=False
        )
        self._handles.append(self._occupancy)

    def _add_fixed(self, shape: HouseShape, frames: Sequence[Mesh]) -> None:
        """All that never changes: what has no container's colour, floors, the shade under furniture, goal frames."""
        fixed = lit_solids(batch.where(batch.owner < 0) for batch in shape.furniture)
        framed = [lit_mesh(frame, GOAL) for frame in frames]
        solid = merged([*framed, fixed, lit_floors(shape.floors)])  # floors last: much of them is hidden by then
        self._mesh("/house/fixed", Layer(mesh=solid), Layer(mesh=lit_tops(shape.shadows), opacity=SHADE))
        self._add_walls("cut", shape.cut_walls)

    def _add_walls(self, mode: str, solids: Sequence[Batch]) -> None:
        if solids:
            self._walls[mode] = self._mesh(f"/house/walls/{mode}", Layer(mesh=lit_solids(solids)))

    def _mesh(self, name: str, *layers: Layer) -> viser.GlbHandle:
        handle = self._scene.add_glb(name, glb(layers), cast_shadow=False, receive_shadow=False)
        self._handles.append(handle)
        return handle

    def _add_room_names(self, shape: HouseShape) -> None:
        self._floors = tuple(shape.floors)
        for i, floor in enumerate(shape.floors):
            label = self._scene.add_label(
                f"/house/rooms/{i}",
                label_words(readable_name(floor.kind)),
                position=(*floor.label_at, 0.05),
                font_screen_scale=0.85,
                anchor="center-center",
            )
            self._rooms.append(label)
            self._handles.append(label)

    def _batch(self, name: str, batch: Batch) -> viser.BatchedMeshHandle:
        handle = self._scene.add_batched_meshes_simple(
            f"{name}/{batch.shape}",
            *unit_mesh(batch.shape),
            batched_wxyzs=batch.wxyz(),
            batched_positions=batch.centre,
            batched_scales=batch.size_m,
            batched_colors=linear_rgb(batch.colour),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._handles.append(handle)
        return handle
