"""Sensor layers of one browser, against a scene that only records what it was asked to show."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from dashboards.model.scene import RobotState
from dashboards.sensing.pictures import Picture
from dashboards.viser_app.drawing.sensor_layers import SensorLayers

STANDING = RobotState(x_m=1.0, y_m=2.0, yaw_rad=0.0)


@dataclass
class Scene:
    """Stands for Viser's."""

    shown: dict[str, Any] = field(default_factory=dict)

    def _add(self, name: str, **more: Any) -> Any:
        made = SimpleNamespace(name=name, visible=True, image=None, points=None, **more)
        made.remove = lambda: self.shown.pop(name)
        self.shown[name] = made
        return made

    def add_camera_frustum(self, name: str, *given: Any, **more: Any) -> Any:
        return self._add(name)

    def add_point_cloud(self, name: str, points: Any, colors: Any, **more: Any) -> Any:
        return self._add(name, colors=colors)

    def add_mesh_simple(self, name: str, *given: Any, **more: Any) -> Any:
        return self._add(name)


@dataclass(eq=False)
class Senses:
    """Stands for a log's: as many points as it is told, which take a while to gather."""

    path: Path
    count: int
    cameras: tuple[str, ...] = ("/camera/front",)
    gathered: bool = False

    @property
    def has_clouds(self) -> bool:
        return self.count > 0

    def pictures(self, stamp_ns: int) -> tuple[Picture, ...]:
        data = b"not a picture"
        return (
            Picture(
                topic=self.cameras[0],
                stamp_ns=stamp_ns,
                mime="image/jpeg",
                data=data,
                on_map=None,
                field_rad=1.0,
                aspect=1.3,
            ),
        )

    def grid(self, stamp_ns: int) -> None:
        return None

    def gather_site(self) -> None:
        time.sleep(0.1)
        self.gathered = True

    def site(self, stamp_ns: int) -> np.ndarray:
        return np.zeros((self.count, 3), dtype=np.float32)


def until_shown(layers: SensorLayers, scene: Scene, count: int | None) -> None:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        layers.show(0, STANDING, pictures=True, points=True, grid=True)
        site = scene.shown.get("/sensors/site")
        if (site is None) == (count is None) and layers._site_shown == (count if count is not None else -1):
            return
        time.sleep(0.02)
    raise AssertionError(f"{layers._site_shown} points are shown, not {count}")


def layers_on(scene: Scene) -> SensorLayers:
    return SensorLayers(SimpleNamespace(scene=scene, atomic=nullcontext), lambda: None)  # type: ignore[arg-type]


def test_the_points_are_those_of_the_log_that_is_open() -> None:
    """Opened one after another while the first is still being gathered."""
    scene = Scene()
    layers = layers_on(scene)
    for name, count in (("a", 3), ("b", 0), ("c", 5)):
        layers.open(Senses(Path(name), count))  # type: ignore[arg-type]
    until_shown(layers, scene, 5)
    layers.open(Senses(Path("b"), 0))  # type: ignore[arg-type]
    until_shown(layers, scene, None)


def test_a_log_that_has_grown_keeps_its_points_until_there_are_more() -> None:
    scene = Scene()
    layers = layers_on(scene)
    layers.open(Senses(Path("a"), 3))  # type: ignore[arg-type]
    until_shown(layers, scene, 3)
    layers.open(Senses(Path("a"), 7))  # type: ignore[arg-type]
    layers.show(0, STANDING, pictures=True, points=True, grid=True)
    assert layers._site_shown == 3
    until_shown(layers, scene, 7)


def test_a_picture_that_cannot_be_decoded_leaves_its_camera_bare() -> None:
    scene = Scene()
    layers = layers_on(scene)
    layers.open(Senses(Path("a"), 0))  # type: ignore[arg-type]
    layers.show(0, STANDING, pictures=True, points=True, grid=True)
    (frustum,) = scene.shown.values()
    assert frustum.image is None
    assert tuple(frustum.position)[:2] == (1.0, 2.0), "on the robot, where no log tells its place"
    layers.show(0, STANDING, pictures=False, points=True, grid=True)
    assert scene.shown == {}
    layers.open(None)
    layers.show(0, STANDING, pictures=True, points=True, grid=True)
    assert scene.shown == {}
