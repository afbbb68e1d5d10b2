"""Colours of all views, safe for colour-blind eyes, the same in 3D, panels, pages and figures.

There are three families. Runs have hues, most of them those of Okabe and Ito ("Color Universal Design", 2008), but
not green and yellow. Findings (seen, goal) have those two, greys, and a dark red for failures. Phases are one slate
hue, distinguished by lightness. Beliefs have their own scale in workbench/belief_colours.py.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from workbench.arrays import Floats, Uints8

Colour = tuple[int, int, int]
"""Red, green, blue, each 0 to 255."""

RUNS: tuple[Colour, ...] = (
    (0, 114, 178),
    (213, 94, 0),
    (204, 121, 167),
    (230, 159, 0),
    (86, 180, 233),
    (90, 40, 130),
    (128, 70, 20),
    (70, 70, 70),
)
"""The first is the run in focus; ghosts follow. Where there are more, names begin with the run's number."""

FLOORS: dict[str, Colour] = {
    "kitchen": (222, 208, 178),
    "livingroom": (208, 186, 156),
    "bedroom": (190, 198, 214),
    "bathroom": (182, 210, 206),
}
FLOOR_OTHER: Colour = (208, 206, 200)
WALL: Colour = (244, 243, 240)
WALL_CAP: Colour = (70, 74, 84)
DOOR_FRAME: Colour = (140, 128, 112)
DOOR_SHUT: Colour = (168, 154, 134)
GLASS: Colour = (168, 208, 228)

SEARCHED: Colour = (150, 160, 172)
KNOWN: Colour = (186, 190, 196)
UNREACHABLE: Colour = (206, 202, 200)
NO_BELIEF: Colour = (228, 222, 212)
FOUND: Colour = (0, 158, 115)
FAILED: Colour = (158, 28, 58)
UNSEEN: Colour = (20, 20, 20)
UNOPENED: Colour = (96, 102, 112)
OCCUPIED: Colour = (66, 84, 120)
NEUTRAL: Colour = (233, 231, 227)
GOAL: Colour = (240, 228, 66)
"""Places and items that the goal names."""
ITEM: Colour = (44, 49, 58)
"""Other items that were seen."""
SIGHT: Colour = (38, 70, 110)
IN_SIGHT: Colour = (240, 247, 255)
"""Edge and area of what the robot sees; the first also of viewpoints."""

TRIMS: dict[str, Colour] = {
    "wood": (176, 148, 116),
    "dark": (92, 92, 98),
    "metal": (172, 178, 184),
    "white": (247, 246, 243),
    "fabric": (208, 206, 204),
    "plant": (132, 160, 118),
    "pot": (178, 138, 112),
    "screen": (54, 58, 66),
    "water": (188, 214, 224),
}
PHASES: dict[str, str] = {
    "moving": "#cbd0de",
    "searching": "#343c60",
    "manipulating": "#747da0",
    "planning": "#a6adc7",
    "waiting": "#f0f1f4",
}


@lru_cache(maxsize=1)
def _linear_table() -> Uints8:
    return np.round(linear(np.arange(256, dtype=np.uint8)) * 255).astype(np.uint8)


def linear(colours: Uints8) -> Floats:
    """Colours from sRGB, 0 to 255, to linear RGB, 0 to 1 (IEC 61966-2-1), the same shape."""
    shade = np.asarray(colours, dtype=np.float64) / 255
    return np.where(shade <= 0.04045, shade / 12.92, ((shade + 0.055) / 1.055) ** 2.4)


def linear_rgb(colours: Uints8) -> Uints8:
    """Colours in linear RGB instead of sRGB, both 0 to 255, the same shape.

    Viser expects linear RGB for batched meshes and sRGB for everything else; sRGB values in a batch would look far
    too pale.
    """
    return _linear_table()[colours]


def run_colour(index: int) -> Colour:
    """The colour of the index-th run; after the eighth the colours repeat, and the runs have numbers."""
    return RUNS[index % len(RUNS)]


def run_number(index: int, runs: int) -> str:
    """The number that stands on the colour of the index-th of several runs; "" while colours tell them apart."""
    return str(index + 1) if runs > len(RUNS) else ""


def ink(colour: Colour) -> str:
    """Black or white, whichever is read better on a colour (WCAG 2.1, relative luminance)."""
    light = float(linear_rgb(np.array(colour, dtype=np.uint8)) / 255 @ np.array([0.2126, 0.7152, 0.0722]))
    return "#111" if light > 0.18 else "#fff"


def floor_colour(kind: str) -> Colour:
    return FLOORS.get(kind.lower().replace(" ", ""), FLOOR_OTHER)


def css(colour: Colour | Uints8) -> str:
    """ "#rrggbb"."""
    return "#{:02x}{:02x}{:02x}".format(*(int(c) for c in colour))


def unit_rgb(colour: Colour) -> tuple[float, float, float]:
    """The colour with parts in 0 to 1, as matplotlib takes it."""
    return (colour[0] / 255, colour[1] / 255, colour[2] / 255)
