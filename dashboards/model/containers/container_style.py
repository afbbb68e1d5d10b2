"""Appearance of containers: colours and bar heights from a scene, the same in every view."""

from __future__ import annotations

import numpy as np

from dashboards.model.scene import STATUSES, Scene
from dashboards.palette import FOUND, KNOWN, NO_BELIEF, SEARCHED, UNREACHABLE
from workbench.arrays import Floats, Uints8
from workbench.belief_colours import belief_colours

BAR_M = 1.1
"""Height of a bar of belief at the top of the scale."""


def belief_shares(scene: Scene) -> Floats:
    """Beliefs as fractions of the scale's top, float64 (n,); NaN where there is none."""
    return scene.belief / scene.top_belief if scene.top_belief > 0 else scene.belief * np.nan


def bar_heights_m(scene: Scene) -> Floats:
    """Heights of the bars over containers in metres, float64 (n,); 0 for none."""
    return np.nan_to_num(belief_shares(scene)) * BAR_M


def container_colours(scene: Scene) -> Uints8:
    """One colour for each container: of its belief, or of what else is known of it. uint8 (n, 3)."""
    share = belief_shares(scene)
    colours = belief_colours(share)
    colours[np.isnan(share)] = NO_BELIEF
    for status, colour in (("searched", SEARCHED), ("known", KNOWN), ("unreachable", UNREACHABLE)):
        colours[scene.status == STATUSES.index(status)] = colour
    seen = (scene.status == STATUSES.index("searched")) | (scene.status == STATUSES.index("known"))
    colours[seen & scene.holds_focus] = FOUND
    return colours
