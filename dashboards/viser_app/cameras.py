"""Camera poses that fit the house: from an angle, from above, behind the robot."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import cos, floor, inf, log10, radians, sin, tan

import numpy as np
import viser

from dashboards.geometry.house import HouseShape
from dashboards.geometry.room_names import PictureView
from dashboards.model.scene import RobotState
from workbench.arrays import Floats, Floats32

FIELD_OF_VIEW = radians(38)
FILL = 0.92
"""Share of the picture that the house fills."""
TILT_DEG = 54.0
"""Above the horizon, when not from above."""
TALL_M = 1.2
"""Assumed height of what stands in a house."""
MARKS_M = 1.35
"""Height above a container (its bar, its number) that must be visible as well."""
BAR_PX = 110
"""The scale bar's length in pixels, at most."""
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CameraPose:
    """Where a camera is and what it looks at, in metres on the map."""

    position: Vector
    look_at: Vector


def fitted(
    shape: HouseShape,
    *,
    from_above: bool = False,
    aspect: float = 1.6,
) -> CameraPose:
    """A pose that shows the whole house, as large as it can be.

    Args:
        from_above: straight down, y up; otherwise from the south, a little from the west.
        aspect: width over height of the picture.
    """
    tilt = radians(89.9 if from_above else TILT_DEG)
    turn = radians(-90.0 if from_above else -104.0)
    back = np.array([cos(tilt) * cos(turn), cos(tilt) * sin(turn), sin(tilt)])
    right = np.array([-sin(turn), cos(turn), 0.0])
    up = np.cross(back, right)
    ground = np.concatenate([floor.vertices for floor in shape.floors] or [_corners(shape)]).astype(np.float64)
    over = np.array(shape.tops_m, dtype=np.float64).reshape(-1, 3) + np.array([0.0, 0.0, MARKS_M])
    points = np.concatenate([ground, ground + np.array([0.0, 0.0, TALL_M]), over])
    half = tan(FIELD_OF_VIEW / 2)
    at, distance = np.array([*shape.centre, 0.0]), 2 * shape.reach_m / half
    for _ in range(40):
        away = points - at
        depth = distance - away @ back
        x, y = away @ right / depth / half / aspect, away @ up / depth / half
        spread = max((x.max() - x.min()) / 2, (y.max() - y.min()) / 2) / FILL
        middle = ((x.max() + x.min()) / 2 * aspect, (y.max() + y.min()) / 2)
        at = at + (right * middle[0] + up * middle[1]) * half * distance * 0.7
        distance = max(1.0, distance * (1 + 0.7 * (spread - 1)))
    # The camera orbits about a point on the floor, so slide along the view until it is one.
    floor = at - back * (at[2] / back[2])
    eye = at + back * distance
    return CameraPose(_vector(eye), _vector(floor))


def _corners(shape: HouseShape) -> Floats32:
    corners = product((shape.low[0], shape.high[0]), (shape.low[1], shape.high[1]), (0.0,))
    return np.array(list(corners), dtype=np.float32)


def _vector(values: Floats) -> Vector:
    return (float(values[0]), float(values[1]), float(values[2]))


def behind(robot: RobotState) -> CameraPose:
    """A pose above and behind the robot, which is in the middle of the picture."""
    c, s = cos(robot.yaw_rad), sin(robot.yaw_rad)
    return CameraPose((robot.x_m - 4.4 * c, robot.y_m - 4.4 * s, 3.8), (robot.x_m, robot.y_m, 0.4))


def close_to(x_m: float, y_m: float) -> CameraPose:
    """A pose that looks at one place in the house from nearby."""
    return CameraPose((x_m - 0.9, y_m - 3.0, 3.8), (x_m, y_m, 0.6))


def view_of(camera: viser.CameraHandle) -> PictureView | None:
    """What a browser's picture shows; None while its size is not known."""
    wide, high = camera.image_width, camera.image_height
    if not wide or not high or np.allclose(camera.position, camera.look_at):
        return None
    return PictureView(
        position=_vector(camera.position),
        look_at=_vector(camera.look_at),
        half_tan=tan(camera.fov / 2),
        width=wide,
        height=high,
    )


def scale_of(camera: viser.CameraHandle) -> tuple[float, str] | None:
    """A bar's width in pixels and its round length in words, true in the middle of the picture; None without one."""
    if not camera.image_height:
        return None
    away_m = float(np.linalg.norm(np.subtract(camera.position, camera.look_at)))
    metres_a_pixel = 2 * away_m * tan(camera.fov / 2) / camera.image_height
    if not 0 < metres_a_pixel < inf:
        return None
    power = 10.0 ** floor(log10(BAR_PX * metres_a_pixel))
    metres = max(m * power for m in (1, 2, 5) if m * power <= BAR_PX * metres_a_pixel)
    return metres / metres_a_pixel, f"{round(100 * metres)} cm" if metres < 1 else f"{metres:g} m"


def begin_at(server: viser.ViserServer, pose: CameraPose) -> None:
    """The pose of the camera for browsers that arrive; an address with a camera of its own takes precedence."""
    server.initial_camera.fov = FIELD_OF_VIEW
    server.initial_camera.up = (0.0, 0.0, 1.0)
    server.initial_camera.position = pose.position
    server.initial_camera.look_at = pose.look_at


def look(client: viser.ClientHandle, pose: CameraPose) -> None:
    """Moves a browser's camera."""
    with client.atomic():
        client.camera.up_direction = (0.0, 0.0, 1.0)
        client.camera.fov = FIELD_OF_VIEW
        client.camera.position = pose.position
        client.camera.look_at = pose.look_at
