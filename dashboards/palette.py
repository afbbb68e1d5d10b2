"""Colours of all views, safe for colour-blind eyes, the same in 3D, panels and figures.

Runs take the colours of Okabe and Ito ("Color Universal Design", 2008); beliefs have workbench/belief_colours.py.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from workbench.arrays import Uints8

Colour = tuple[int, int, int]
"""Red, green, blue, each 0 to 255."""

RUNS: tuple[Colour, ...] = (
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (204, 121, 167),
    (230, 159, 0),
    (86, 180, 233),
    (70, 70, 70),
    (150, 120, 40),
)
"""The first is the run in focus; ghosts follow."""

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
UNSEEN: Colour = (20, 20, 20)
UNOPENED: Colour = (96, 102, 112)
OCCUPIED: Colour = (66, 84, 120)
NEUTRAL: Colour = (233, 231, 227)
GOAL: Colour = (240, 228, 66)
"""Places and items that the goal names."""
ITEM: Colour = (44, 49, 58)
"""Other items that were seen."""

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
    "moving": "#56B4E9",
    "searching": "#E69F00",
    "manipulating": "#009E73",
    "planning": "#CC79A7",
    "waiting": "#d9dadd",
}


@lru_cache(maxsize=1)
def _linear_table() -> Uints8:
    shade = np.arange(256) / 255
    light = np.where(shade <= 0.04045, shade / 12.92, ((shade + 0.055) / 1.055) ** 2.4)
    return np.round(light * 255).astype(np.uint8)


def linear_rgb(colours: Uints8) -> Uints8:
    """Colours in linear RGB instead of sRGB (IEC 61966-2-1), the same shape.

    Viser expects linear RGB for batched meshes and sRGB for everything else; sRGB values in a batch would look far
    too pale.
    """
    return _linear_table()[colours]


def run_colour(index: int) -> Colour:
    """The colour of the index-th run; after the eighth the colours repeat."""
    return RUNS[index % len(RUNS)]


def floor_colour(kind: str) -> Colour:
    return FLOORS.get(kind.lower().replace(" ", ""), FLOOR_OTHER)


def css(colour: Colour | Uints8) -> str:
    """ "#rrggbb"."""
    return "#{:02x}{:02x}{:02x}".format(*(int(c) for c in colour))


def unit_rgb(colour: Colour) -> tuple[float, float, float]:
    """The colour with parts in 0 to 1, as matplotlib takes it."""
    return (colour[0] / 255, colour[1] / 255, colour[2] / 255)
