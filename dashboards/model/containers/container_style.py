"""Appearance of containers: colours and bar heights from a scene, the same in every view."""

from __future__ import annotations

import numpy as np

from dashboards.model.scene import STATUSES, Scene
from dashboards.palette import FOUND, KNOWN, NO_BELIEF, SEARCHED, UNREACHABLE
from workbench.arrays import Floats, Uints8
from workbench.belief_colours import belief_colours

BAR_M = 1.1
"""Height of a bar of belief at the top of the scale."""
MIN_LEFT, MAX_LEFT = 0.001, 8
"""What is left of a belief is put into words from this probability on, over so many containers at most."""


def belief_fractions(scene: Scene) -> Floats:
    """Beliefs as fractions of the scale's top, float64 (n,); NaN where there is none."""
    return _fractions(scene, scene.belief)


def bar_heights_m(scene: Scene) -> Floats:
    """Heights of the bars over containers in metres, float64 (n,); 0 for none.

    Where a look may have missed what is in focus, the bar is what is left of the belief.
    """
    return np.nan_to_num(_bar_fractions(scene)) * BAR_M


def bar_colours(scene: Scene) -> Uints8:
    """The colour of each bar, that of its height on the scale of beliefs; uint8 (n, 3)."""
    return belief_colours(_bar_fractions(scene))


def left_labels(scene: Scene) -> tuple[tuple[int, str], ...]:
    """Containers over which words say what is left of the belief after looks that may have missed, the likeliest
    first, with the words."""
    shown = np.flatnonzero(scene.left >= MIN_LEFT)
    likeliest = shown[np.argsort(-scene.left[shown], kind="stable")][:MAX_LEFT]
    return tuple((int(i), f"{_percent(float(scene.left[i]))} left") for i in likeliest)


def _bar_fractions(scene: Scene) -> Floats:
    return _fractions(scene, np.where(np.isnan(scene.belief), scene.left, scene.belief))


def _percent(value: float) -> str:
    return f"{100 * value:.1f} %" if value < 0.1 else f"{100 * value:.0f} %"


def _fractions(scene: Scene, belief: Floats) -> Floats:
    return belief / scene.top_belief if scene.top_belief > 0 else belief * np.nan


def container_colours(scene: Scene) -> Uints8:
    """One colour for each container: of its belief, or of what else is known of it. uint8 (n, 3)."""
    share = belief_fractions(scene)
    colours = belief_colours(share)
    colours[np.isnan(share)] = NO_BELIEF
    for status, colour in (("searched", SEARCHED), ("known", KNOWN), ("unreachable", UNREACHABLE)):
        colours[scene.status == STATUSES.index(status)] = colour
    seen = (scene.status == STATUSES.index("searched")) | (scene.status == STATUSES.index("known"))
    colours[seen & scene.holds_focus] = FOUND
    return colours
