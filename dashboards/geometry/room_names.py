"""Placement of room names in a picture: on their own floor, not behind a wall, and beside other labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import hypot

import numpy as np
import shapely

from dashboards.geometry.floors import Floor
from workbench.arrays import Floats
from workbench.tolerances import MIN_LENGTH_M, MIN_SLOPE
from workbench.worlds.geometry import Point

Box = tuple[float, float, float, float]
"""Left, top, right, bottom in pixels."""
Point3 = tuple[float, float, float]
CHAR_PX, LINE_PX = 6.4, 17.0
"""A letter's width and a label's height, as Viser draws names of rooms; numbers and items are no larger."""
GAP_PX = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureView:
    """A camera and its picture.

    Attributes:
        position, look_at: in metres on the map; z is up. half_tan: tangent of half the vertical field of view.
        width, height: of the picture, in pixels.
    """

    position: Point3
    look_at: Point3
    half_tan: float
    width: float
    height: float

    def pixel(self, point: Point3) -> tuple[float, float] | None:
        """Where a point is in the picture, from its left and top; None behind the camera."""
        right, up, away = _axes(self.position, self.look_at) @ np.subtract(point, self.position)
        if away > -1e-3:
            return None
        unit = self.half_tan * -away
        return (
            self.width / 2 + right / unit * self.height / 2,
            self.height / 2 - up / unit * self.height / 2,
        )

    def floor_at(self, x_px: float, y_px: float) -> Point | None:
        """The point of the floor in a pixel; None at or above the horizon."""
        right, up, back = _axes(self.position, self.look_at)
        across = (x_px - self.width / 2) / (self.height / 2) * self.half_tan
        along = (self.height / 2 - y_px) / (self.height / 2) * self.half_tan
        ray = right * across + up * along - back
        if ray[2] > -MIN_SLOPE:
            return None
        at = np.array(self.position) - ray * (self.position[2] / ray[2])
        return float(at[0]), float(at[1])


@lru_cache(maxsize=32)
def _axes(position: Point3, look_at: Point3) -> Floats:
    """Right, up and back of a camera, as rows."""
    back = np.subtract(position, look_at)
    back = back / np.linalg.norm(back)
    right = np.cross((0.0, 0.0, 1.0), back)
    long = float(np.linalg.norm(right))
    right = right / long if long > MIN_LENGTH_M else np.array([1.0, 0.0, 0.0])
    axes = np.stack([right, np.cross(back, right), back])
    axes.flags.writeable = False
    return axes


def room_name_places(
    floors: Sequence[Floor], names: Sequence[str], view: PictureView, *, wall_m: float, taken: Sequence[Box]
) -> list[Point | None]:
    """For each room a point of its floor on which its name is clear of other labels, in metres; None for no name.

    Of a room's spots the first is taken at which the whole name is on the room's floor and no wall hides it; else one
    at which its middle does; and none where every spot is covered.

    Args:
        names: one for each floor.
        wall_m: height of the walls, 0 for none.
        taken: what other labels cover.
    """
    covered = list(taken)
    places: list[Point | None] = []
    for floor, name in zip(floors, names, strict=True):
        best: tuple[int, int, Point, Box] | None = None
        for number, spot in enumerate(floor.label_spots):
            box = _box(spot, name, view)
            if box is None or any(_meet(box, other) for other in covered):
                continue
            faults = int(_is_behind(floor, spot, view, wall_m)) * 2 + int(not _lies_on(floor, box, view))
            if best is None or (faults, number) < best[:2]:
                best = (faults, number, spot, box)
            if not best[0]:
                break  # none that follows is better
        places.append(best[2] if best is not None else None)
        if best is not None:
            covered.append(best[3])
    return places


def label_box(point: Point3, words: str, view: PictureView, *, scale: float = 1.0) -> Box | None:
    """What a label that stands on a point covers; None behind the camera."""
    at = view.pixel(point)
    if at is None:
        return None
    wide, high = (len(words) * CHAR_PX + 6) * scale, LINE_PX * scale
    return (at[0] - wide / 2, at[1] - high, at[0] + wide / 2, at[1])


def _box(spot: Point, name: str, view: PictureView) -> Box | None:
    at = view.pixel((*spot, 0.05))
    wide = len(name) * CHAR_PX + 6
    return (at[0] - wide / 2, at[1] - LINE_PX / 2, at[0] + wide / 2, at[1] + LINE_PX / 2) if at else None


def _meet(one: Box, other: Box) -> bool:
    return (
        one[0] < other[2] + GAP_PX
        and other[0] < one[2] + GAP_PX
        and one[1] < other[3] + GAP_PX
        and other[1] < one[3] + GAP_PX
    )


def _lies_on(floor: Floor, box: Box, view: PictureView) -> bool:
    corners = [view.floor_at(x, y) for x in (box[0], box[2]) for y in (box[1], box[3])]
    return all(corner is not None and shapely.contains_xy(floor.polygon, *corner) for corner in corners)


def _is_behind(floor: Floor, spot: Point, view: PictureView, wall_m: float) -> bool:
    """Whether a wall of the room stands between the spot and the camera."""
    x, y = view.position[0] - spot[0], view.position[1] - spot[1]
    away, high = hypot(x, y), view.position[2]
    if wall_m <= 0 or high <= 0 or away < MIN_LENGTH_M:
        return False
    reach = min(1.0, wall_m / high)
    return not floor.polygon.contains(shapely.LineString([spot, (spot[0] + x * reach, spot[1] + y * reach)]))
