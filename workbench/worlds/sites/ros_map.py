"""Reading and writing occupancy maps of ROS map_server: YAML with a PGM or PNG image.

Cell values are those of ROS 2's map_server (map_pixels.py): 0 free to 100 occupied, -1 unknown. Row 0 of the image is
its top, which has the largest y. Unknown cells count as occupied here, so that no robot plans through unsurveyed
space.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast

import msgspec
import numpy as np

from workbench.errors import FileMissing, MalformedFile
from workbench.files import write_atomically, write_text
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.maps.rotated_grid import axis_aligned, is_occupied
from workbench.worlds.sites.map_pixels import (
    GreyPixels,
    MapMode,
    PixelRules,
    cell_values,
    cell_values_since_2025,
    grey_pixels,
)

T = TypeVar("T", bound=msgspec.Struct)

MAX_CELLS = 16_000_000
"""Largest map: 200 m by 200 m at 0.05 m. Larger ones are taken as a mistake of units or a damaged file."""

MAX_YAML_BYTES = 1_000_000
OCCUPIED, FREE, UNKNOWN = 0, 254, 205
"""Pixel values that map_saver writes."""


class _MapFile(msgspec.Struct, frozen=True, kw_only=True):
    image: str
    resolution: Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
    origin: tuple[float, float, float]
    negate: int | bool | str = 0
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196
    mode: str = "trinary"


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyMap:
    """A survey's map as map_server reads it.

    Attributes:
        grid: the occupancy grid, axis-aligned, unknown cells occupied.
        grey_read_as_free: cells of the grey that map savers write for unknown (205) which the file's thresholds call
            free.
        read_otherwise: cells that are free by one release of map_server and not by another.
    """

    grid: OccupancyGrid
    grey_read_as_free: int
    read_otherwise: int = 0


def read_map(path: Path) -> OccupancyGrid:
    """The occupancy grid of a map_server YAML file, with unknown cells occupied.

    Raises:
        FileMissing: the YAML or its image is missing.
        MalformedFile: not a map, or a too large one.
    """
    return read_survey_map(path).grid


def read_survey_map(path: Path) -> SurveyMap:
    """The map of a map_server YAML file. Raises as read_map."""
    described = read_yaml(path, _MapFile)
    pixels = _read_pixels(path.parent / described.image)
    rules = PixelRules(
        mode=_mode(path, described.mode),
        negate=_negate(path, described.negate),
        occupied_thresh=described.occupied_thresh,
        free_thresh=described.free_thresh,
    )
    values = cell_values(pixels, rules)
    x_m, y_m, yaw_rad = described.origin
    grid = axis_aligned(
        is_occupied(np.flipud(values)), origin=(x_m, y_m), yaw_rad=yaw_rad, resolution_m=described.resolution
    )
    grey = np.rint(pixels.brightness * 255) == UNKNOWN
    free = int((grey & ~is_occupied(values)).sum()) if rules.mode != "raw" else 0
    differ = is_occupied(values) != is_occupied(cell_values_since_2025(pixels, rules))
    return SurveyMap(grid=grid, grey_read_as_free=free, read_otherwise=int(differ.sum()))


def write_map(grid: OccupancyGrid, path: Path) -> None:
    """Write a map_server YAML file and its PGM image, readable by read_map and by ROS."""
    picture = path.with_suffix(".pgm")
    rows, columns = grid.occupied.shape
    pixels = np.where(np.flipud(grid.occupied), OCCUPIED, FREE).astype(np.uint8)
    write_atomically(picture, f"P5\n{columns} {rows}\n255\n".encode("ascii") + pixels.tobytes())
    write_text(
        path,
        f"image: {picture.name}\nresolution: {grid.resolution_m:g}\n"
        f"origin: [{grid.origin[0]:g}, {grid.origin[1]:g}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
    )


def read_yaml(path: Path, kind: type[T]) -> T:
    """Read a YAML file into a struct; errors give the position of the first mistake.

    Raises:
        FileMissing, MalformedFile.
    """
    if not path.is_file():
        raise FileMissing(path)
    if path.stat().st_size > MAX_YAML_BYTES:
        raise MalformedFile(path, f"larger than {MAX_YAML_BYTES} bytes", "Give a survey file, not a data file")
    try:
        text = path.read_bytes()
        if b"nan" in text.lower() and _holds_nan(msgspec.yaml.decode(text)):
            raise MalformedFile(path, "a number is .nan", "Write it out, or leave the field away")
        return msgspec.yaml.decode(text, type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError, ValueError) as error:
        reason = " ".join(str(error).split())[:300].rstrip(".")
        raise MalformedFile(path, reason, "Compare it with docs/spot.md") from error


def _holds_nan(part: Any) -> bool:
    """Whether a number somewhere is not a number: no limit of a schema refuses one."""
    if isinstance(part, dict):
        return any(map(_holds_nan, cast("dict[Any, Any]", part).values()))
    if isinstance(part, list):
        return any(map(_holds_nan, cast("list[Any]", part)))
    return isinstance(part, float) and isnan(part)


def _mode(path: Path, written: str) -> MapMode:
    """The mode by its name, in any case, as map_server takes it."""
    for mode in ("trinary", "scale", "raw"):
        if written.lower() == mode:
            return mode
    raise MalformedFile(path, f"mode {written!r} is unknown", "Write trinary, scale or raw")


def _negate(path: Path, written: int | bool | str) -> bool:
    """negate as a number or a truth value, quoted or not."""
    if not isinstance(written, str):
        return bool(written)
    known = {"0": False, "1": True, "false": False, "true": True}
    if written.lower() not in known:
        raise MalformedFile(path, f"negate {written!r} is neither true nor false", "Write negate: 0 or negate: 1")
    return known[written.lower()]


def _read_pixels(path: Path) -> GreyPixels:
    """The image's brightness and opacity, row 0 on top. Reads PGM (P2, P5) and what Pillow reads."""
    if not path.is_file():
        raise FileMissing(path)
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as picture:
            if picture.width * picture.height > MAX_CELLS:
                raise MalformedFile(path, f"{picture.width} x {picture.height} cells", "Save a coarser map")
            return grey_pixels(picture)
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise MalformedFile(path, f"not a picture ({error})", "Save the map as PGM or PNG") from error
