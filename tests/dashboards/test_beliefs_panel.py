"""What the panel of beliefs says of its terms, and what the probabilities add up to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from toy_run import ns, toy_run

from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.panels.beliefs import HINTS, beliefs


def test_the_panel_tells_what_the_probabilities_add_up_to() -> None:
    timeline = timeline_of(toy_run())
    scene = scene_at(timeline, ns(1))
    belief = np.full(len(scene.belief), np.nan)
    belief[:3] = 0.9, 0.5, 0.25
    assert "Adds up to 1.65: the expected number" in beliefs(replace(scene, belief=belief), timeline)
    nothing = np.full(len(scene.belief), np.nan)
    assert "Adds up to" not in beliefs(replace(scene, belief=nothing), timeline)


def test_each_term_in_a_heading_has_a_tooltip() -> None:
    timeline = timeline_of(toy_run())
    shown = beliefs(scene_at(timeline, ns(1)), timeline)
    for heading, hint in HINTS.items():
        assert f'title="{hint}">{heading}</th>' in shown
