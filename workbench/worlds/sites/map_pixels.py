"""Cell values of map images by the rules of ROS 2's map_server: trinary, scale and raw.

Source: nav2_map_server/src/map_io.cpp, loadMapFromFile (navigation2, releases to Iron). A pixel's shade is the mean
of red, green and blue on a scale of 0 to 1; in trinary mode an alpha channel is averaged in with the colours. Its
occupancy is 1 - shade, or shade when negate is set.

- trinary: above occupied_thresh 100, else below free_thresh 0, else -1;
- scale: the same, between the thresholds linear from 0 to 100; whatever is not wholly opaque is -1;
- raw: shade times 255, rounded, is the value; above 100 it is -1. negate and thresholds have no effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from workbench.arrays import Floats, Ints8

if TYPE_CHECKING:
    from PIL import Image

MapMode = Literal["trinary", "scale", "raw"]
OCCUPIED, FREE, UNKNOWN = 100, 0, -1
"""Values of nav_msgs/OccupancyGrid."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PixelRules:
    """How a map's YAML file says that its pixels are read; thresholds are occupancies, 0 to 1."""

    mode: MapMode
    negate: bool
    occupied_thresh: float
    free_thresh: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GreyPixels:
    """Pixels of an image, shape (rows, columns), row 0 on top.

    Attributes:
        brightness: mean of red, green and blue, 0 black to 1 white.
        opacity: 0 transparent to 1 opaque; None for an image without an alpha channel.
    """

    brightness: Floats
    opacity: Floats | None = None


def grey_pixels(picture: Image.Image) -> GreyPixels:
    """Brightness and opacity of a Pillow image: grey of 1 to 16 bits, colour, indexed, with and without alpha."""
    if picture.mode.startswith("I"):
        # Pillow scales 16-bit PGM and PNG to 0..65535, whatever the integer type
        return GreyPixels(brightness=np.clip(np.asarray(picture, dtype=np.float64), 0, 65535) / 65535)
    transparent = picture.mode in ("LA", "PA", "La", "RGBA", "RGBa") or "transparency" in picture.info
    channels = np.asarray(picture.convert("RGBA" if transparent else "RGB"), dtype=np.float64) / 255
    brightness = channels[..., :3].sum(axis=-1) / 3
    return GreyPixels(brightness=brightness, opacity=channels[..., 3] if transparent else None)


def cell_values(pixels: GreyPixels, rules: PixelRules) -> Ints8:
    """Values of nav_msgs/OccupancyGrid, shape (rows, columns), row 0 on top as in the image."""
    shade = pixels.brightness
    if rules.mode == "raw":
        value = np.floor(shade * 255 + 0.5)
        return np.where(value <= OCCUPIED, value, UNKNOWN).astype(np.int8)
    if rules.mode == "trinary" and pixels.opacity is not None:
        shade = (3 * shade + pixels.opacity) / 4
    occupancy = shade if rules.negate else 1.0 - shade
    occupied = rules.occupied_thresh < occupancy
    free = occupancy < rules.free_thresh
    between = np.full(shade.shape, float(UNKNOWN))
    if rules.mode == "scale":
        width = rules.occupied_thresh - rules.free_thresh
        if width > 0:
            between = np.rint((occupancy - rules.free_thresh) / width * 100)
        if pixels.opacity is not None:
            clear = pixels.opacity < 1
            occupied, free, between = occupied & ~clear, free & ~clear, np.where(clear, float(UNKNOWN), between)
    return np.where(occupied, float(OCCUPIED), np.where(free, float(FREE), np.clip(between, -1, 100))).astype(np.int8)
