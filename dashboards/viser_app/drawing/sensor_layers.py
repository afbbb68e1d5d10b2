"""Draws sensor data of the run in focus: pictures in front of their cameras, points, blocked cells.

Reading clouds of a long log takes seconds; a thread does it while the rest is already shown.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from threading import Lock, Thread
from typing import Any

import numpy as np
import viser
import viser.transforms

from dashboards.model.scene import RobotState
from dashboards.sensing.grids import BLOCKED, NEAR, GridCells
from dashboards.sensing.pictures import Picture, pixels
from dashboards.sensing.robot_sensors import RobotSensors
from workbench.arrays import Floats, Floats32, Uints8

FRUSTUM_M = 0.4
POINT_M = 0.022
EYE_M = 0.55
LOW, HIGH = (0, 84, 96), (120, 204, 196)
TALLEST_M = 1.5
OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Turns a camera's axes (x right, y down, z ahead) to the robot's (x ahead, y left, z up)."""


class SensorLayers:
    """The layers of one browser."""

    def __init__(self, client: viser.ClientHandle, ready: Callable[[], None]) -> None:
        """ready: called from another thread when a site's points have been gathered."""
        self._client, self._scene = client, client.scene
        self._ready = ready
        self._robot_sensors: RobotSensors | None = None
        self._gathered: RobotSensors | None = None
        self._gathering = False
        self._lock = Lock()
        self._frustums: dict[str, tuple[viser.CameraFrustumHandle, int]] = {}
        self._site: viser.PointCloudHandle | None = None
        self._site_shown = -1
        self._grid: list[viser.MeshHandle] = []
        self._grid_shown: GridCells | None = None

    def open(self, robot_sensors: RobotSensors | None) -> None:
        """Switches to other sensors, or none; for a log that has grown, what is shown stays until there is something
        newer."""
        if robot_sensors is self._robot_sensors:
            return
        if robot_sensors is None or self._robot_sensors is None or robot_sensors.path != self._robot_sensors.path:
            self.clear()
        with self._lock:
            self._robot_sensors = robot_sensors
            begin = self._pending_sensors() is not None and not self._gathering
            self._gathering = self._gathering or begin
        if begin:
            Thread(target=self._gather, name="site points", daemon=True).start()

    def show(self, stamp_ns: int, robot: RobotState, *, pictures: bool, points: bool, grid: bool) -> None:
        """Shows a moment."""
        if self._robot_sensors is None:
            return
        self._show_pictures(self._robot_sensors.pictures(stamp_ns) if pictures else (), robot)
        self._show_points(self._site_at(stamp_ns) if points else None)
        self._show_grid(self._robot_sensors.grid(stamp_ns) if grid else None)

    def _site_at(self, stamp_ns: int) -> Floats32 | None:
        """The points of the site, from the newest gathering of this log."""
        gathered = self._gathered
        same = gathered is not None and self._robot_sensors is not None and gathered.path == self._robot_sensors.path
        return gathered.site(stamp_ns) if gathered is not None and same else None

    def clear(self) -> None:
        """Removes everything."""
        for handle, _ in self._frustums.values():
            handle.remove()
        for handle in (*([self._site] if self._site is not None else ()), *self._grid):
            handle.remove()
        self._frustums, self._site, self._grid, self._grid_shown, self._site_shown = {}, None, [], None, -1

    def _pending_sensors(self) -> RobotSensors | None:
        """The sensors whose clouds have not been gathered yet."""
        robot_sensors = self._robot_sensors
        return (
            robot_sensors
            if robot_sensors is not None and robot_sensors.has_clouds and robot_sensors is not self._gathered
            else None
        )

    def _gather(self) -> None:
        """Gathers until nothing is left: another log may have been opened meanwhile."""
        while True:
            with self._lock:
                robot_sensors = self._pending_sensors()
                self._gathering = robot_sensors is not None
            if robot_sensors is None:
                return
            robot_sensors.gather_site()
            self._gathered = robot_sensors
            self._ready()

    def _show_pictures(self, pictures: tuple[Picture, ...], robot: RobotState) -> None:
        for topic in self._frustums.keys() - {p.topic for p in pictures}:
            self._frustums.pop(topic)[0].remove()
        for place, picture in enumerate(pictures):
            handle, shown = self._frustums.get(picture.topic, (None, -1))
            if shown == picture.stamp_ns and picture.on_map is not None:
                continue
            pose = picture.on_map if picture.on_map is not None else _on_the_robot(robot)
            at: dict[str, Any] = {
                "position": pose[:3, 3],
                "wxyz": viser.transforms.SO3.from_matrix(pose[:3, :3]).wxyz,
            }
            if handle is None:
                handle = self._scene.add_camera_frustum(
                    f"/sensors/cameras/{place}",
                    picture.field_rad,
                    picture.aspect,
                    scale=FRUSTUM_M,
                    thickness=0.012,
                    color=(40, 60, 84),
                    cast_shadow=False,
                )
            handle.position, handle.wxyz = at["position"], at["wxyz"]
            if shown != picture.stamp_ns:
                handle.image = pixels(picture)
            self._frustums[picture.topic] = (handle, picture.stamp_ns)

    def _show_points(self, points: Floats32 | None) -> None:
        count = 0 if points is None else len(points)
        if count == self._site_shown or (points is None and self._site is None):
            return
        self._site_shown = count
        if points is None or not count:
            if self._site is not None:
                self._site.visible = False
            return
        if self._site is None:
            self._site = self._scene.add_point_cloud(
                "/sensors/site", points, _by_height(points), point_size=POINT_M, point_shape="rounded"
            )
        else:
            with self._client.atomic():
                self._site.points, self._site.colors = points.astype(np.float16), _by_height(points)
        self._site.visible = True

    def _show_grid(self, cells: GridCells | None) -> None:
        if cells is self._grid_shown:
            return
        for handle in self._grid:
            handle.remove()
        self._grid, self._grid_shown = [], cells
        if cells is None:
            return
        for part, colour in ((cells.blocked, BLOCKED), (~cells.blocked, NEAR)):
            if part.any():
                self._grid.append(
                    self._scene.add_mesh_simple(
                        f"/sensors/grid/{len(self._grid)}",
                        cells.vertices,
                        cells.faces_of(part),
                        color=colour,
                        opacity=0.55,
                        side="double",
                        cast_shadow=False,
                    )
                )


def _by_height(points: Floats32) -> Uints8:
    """Colours that are paler with height, uint8 (n, 3)."""
    share = np.clip(points[:, 2:] / TALLEST_M, 0.0, 1.0)
    return np.round(np.array(LOW) + share * (np.array(HIGH) - np.array(LOW))).astype(np.uint8)


def _on_the_robot(robot: RobotState) -> Floats:
    """The pose for a camera without a known pose: on the robot, looking ahead."""
    c, s = cos(robot.yaw_rad), sin(robot.yaw_rad)
    pose = np.eye(4)
    pose[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ OPTICAL
    pose[:3, 3] = (robot.x_m, robot.y_m, EYE_M)
    return pose
