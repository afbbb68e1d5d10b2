"""Cell values of map images by the rules of ROS 2's map_server: trinary, scale and raw; and where releases differ.

Source: nav2_map_server/src/map_io.cpp, loadMapFromFile (navigation2), pixel by pixel until its pull request 5071 of
April 2025. A pixel's shade is the mean of red, green and blue on a scale of 0 to 1; in trinary mode an alpha channel
is averaged in with the colours. Its occupancy is 1 - shade, or shade when negate is set.

- trinary: above occupied_thresh 100, else below free_thresh 0, else -1;
- scale: the same, between the thresholds linear from 0 to 100; whatever is not wholly opaque is -1;
- raw: shade times 255, rounded, is the value; above 100 it is -1. negate and thresholds have no effect.

Since that pull request: a pixel is first made grey of 8 bits by its luma; an occupancy that equals a threshold is
occupied or free; in trinary mode too, whatever is not wholly opaque is -1.
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
LUMA = (0.299, 0.587, 0.114)
"""Shares of red, green and blue, as GraphicsMagick makes a picture grey (Rec. 601)."""


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
        luma: brightness as the eye sees it (Rec. 601), in steps of 1/255; of grey images the brightness.
        opacity: 0 transparent to 1 opaque; None for an image without an alpha channel.
    """

    brightness: Floats
    luma: Floats
    opacity: Floats | None = None


def grey_pixels(picture: Image.Image) -> GreyPixels:
    """Brightness and opacity of a Pillow image: grey of 1 to 16 bits, colour, indexed, with and without alpha."""
    if picture.mode.startswith("I"):
        # Pillow scales 16-bit PGM and PNG to 0..65535, whatever the integer type
        brightness = np.clip(np.asarray(picture, dtype=np.float64), 0, 65535) / 65535
        return GreyPixels(brightness=brightness, luma=_in_steps(brightness))
    transparent = picture.mode in ("LA", "PA", "La", "RGBA", "RGBa") or "transparency" in picture.info
    channels = np.asarray(picture.convert("RGBA" if transparent else "RGB"), dtype=np.float64) / 255
    brightness = channels[..., :3].sum(axis=-1) / 3
    luma = _in_steps(channels[..., :3] @ np.array(LUMA))
    return GreyPixels(brightness=brightness, luma=luma, opacity=channels[..., 3] if transparent else None)


def _in_steps(shade: Floats) -> Floats:
    return np.floor(shade * 255 + 0.5) / 255


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


def cell_values_since_2025(pixels: GreyPixels, rules: PixelRules) -> Ints8:
    """As cell_values, by map_server since navigation2's pull request 5071."""
    shade = pixels.luma
    if rules.mode == "raw":
        value = np.rint(shade * 255)
        return np.where(value <= OCCUPIED, value, UNKNOWN).astype(np.int8)
    # single precision, as there: a grey of a fifth equals a threshold of 0.2
    shade = np.rint(shade * 255).astype(np.float32) / np.float32(255)
    occupancy = shade if rules.negate else np.float32(1) - shade
    occupied_thresh, free_thresh = np.float32(rules.occupied_thresh), np.float32(rules.free_thresh)
    values = np.where(occupancy >= occupied_thresh, OCCUPIED, UNKNOWN)
    values = np.where(occupancy <= free_thresh, FREE, values)
    if rules.mode == "scale" and occupied_thresh > free_thresh:
        between = (free_thresh < occupancy) & (occupancy < occupied_thresh)
        scaled = np.floor((occupancy - free_thresh) / (occupied_thresh - free_thresh) * 100 + 0.5)
        values = np.where(between, scaled, values)
    if pixels.opacity is not None:
        values = np.where(pixels.opacity < 1, UNKNOWN, values)
    return values.astype(np.int8)
