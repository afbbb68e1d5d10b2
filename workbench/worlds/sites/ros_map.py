"""Reading and writing occupancy maps of ROS map_server: YAML with a PGM or PNG image.

Source: map_server (ROS 1 and 2). A pixel's occupancy is (255 - value) / 255, or value / 255 when negate is set;
above occupied_thresh it is occupied, below free_thresh it is free, between them unknown. Row 0 is the top of the
image, which has the largest y. Unknown cells count as occupied here, so that no robot plans through unsurveyed
    space.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeVar

import msgspec
import numpy as np
import numpy.typing as npt

from workbench.errors import FileMissing, MalformedFile
from workbench.worlds.maps.occupancy import OccupancyGrid

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
    negate: int = 0
    occupied_thresh: float = 0.65
    free_thresh: float = 0.196
    mode: str = "trinary"


def read_map(path: Path) -> OccupancyGrid:
    """The occupancy grid of a map_server YAML file.

    Raises:
        FileMissing: the YAML or its image is missing.
        MalformedFile: not a map, or a rotated or too large one.
    """
    described = read_yaml(path, _MapFile)
    if described.origin[2] != 0.0:
        raise MalformedFile(path, "its origin is rotated", "Save the map with yaw 0")
    picture = path.parent / described.image
    pixels = _read_pixels(picture)
    share = pixels / 255.0 if described.negate else (255.0 - pixels) / 255.0
    occupied = np.flipud(share >= described.free_thresh)
    return OccupancyGrid(
        origin=(described.origin[0], described.origin[1]),
        resolution_m=described.resolution,
        occupied=np.ascontiguousarray(occupied),
    )


def write_map(grid: OccupancyGrid, path: Path) -> None:
    """Write a map_server YAML file and its PGM image, readable by read_map and by ROS."""
    picture = path.with_suffix(".pgm")
    rows, columns = grid.occupied.shape
    pixels = np.where(np.flipud(grid.occupied), OCCUPIED, FREE).astype(np.uint8)
    picture.write_bytes(f"P5\n{columns} {rows}\n255\n".encode("ascii") + pixels.tobytes())
    path.write_text(
        f"image: {picture.name}\nresolution: {grid.resolution_m:g}\n"
        f"origin: [{grid.origin[0]:g}, {grid.origin[1]:g}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
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
        return msgspec.yaml.decode(path.read_bytes(), type=kind)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError, ValueError) as error:
        reason = " ".join(str(error).split())[:300].rstrip(".")
        raise MalformedFile(path, reason, "Compare it with docs/spot.md") from error


def _read_pixels(path: Path) -> npt.NDArray[np.uint8]:
    """The grey values, shape (rows, columns), row 0 on top. Reads PGM (P2, P5) and what Pillow reads."""
    if not path.is_file():
        raise FileMissing(path)
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as picture:
            if picture.width * picture.height > MAX_CELLS:
                raise MalformedFile(path, f"{picture.width} x {picture.height} cells", "Save a coarser map")
            return np.asarray(picture.convert("L"), dtype=np.uint8)
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        raise MalformedFile(path, f"not a picture ({error})", "Save the map as PGM or PNG") from error
