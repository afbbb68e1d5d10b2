"""The light of the 3D view, and what it makes of a matt surface.

A bright sky without direction, a warm sun from the south-west, a weak light against it. Nothing casts shadows, so the
light on what stands still can be worked out once: `radiance` is that of three.js's MeshStandardMaterial of roughness
1 (Lambert's law, and a faint gloss by Schlick, GGX and Smith) before tone mapping.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from dashboards.palette import Colour, linear
from workbench.arrays import Floats, Uints8


@dataclass(frozen=True, slots=True, kw_only=True)
class Lamp:
    """A directional light; it shines from its position towards the origin of the map."""

    name: str
    colour: Colour
    intensity: float
    position: tuple[float, float, float]


SKY: Colour = (250, 252, 255)
GROUND: Colour = (190, 184, 176)
SKY_INTENSITY = 1.9
LAMPS = (
    Lamp(name="sun", colour=(255, 246, 232), intensity=1.7, position=(-6.0, -9.0, 14.0)),
    Lamp(name="fill", colour=(226, 236, 255), intensity=0.5, position=(9.0, 6.0, 6.0)),
)
REFLECTANCE = 0.04
"""Of a dielectric at normal incidence."""
USUAL_VIEW = 0.75
"""The cosine between a surface's normal and the direction of the camera, for the gloss: the view is from above."""


def radiance(colours: Uints8, normals: Floats) -> Floats:
    """The light that surfaces send to the camera, linear RGB; may exceed 1.

    Args:
        colours: sRGB, uint8 (n, 3).
        normals: unit vectors in the map frame, (n, 3).
    """
    ambient = SKY_INTENSITY * (_rgb(SKY) + _rgb(GROUND)) / 2  # Viser puts its hemisphere light at the origin: it has
    light, gloss = np.tile(ambient, (len(normals), 1)), np.zeros((len(normals), 3))  # no direction there
    for lamp in LAMPS:
        towards = np.array(lamp.position) / np.linalg.norm(lamp.position)
        facing = np.clip(normals @ towards, 0.0, None)
        beam = facing[:, None] * lamp.intensity * _rgb(lamp.colour)
        light += beam
        gloss += REFLECTANCE * 0.5 / (facing + USUAL_VIEW)[:, None] * beam
    return (linear(colours) * light + gloss) / pi


def _rgb(colour: Colour) -> Floats:
    return linear(np.array(colour, dtype=np.uint8))
