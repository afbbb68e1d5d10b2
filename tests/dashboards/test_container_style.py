"""Colours in the 3D view equal those of the legend: Viser takes a batch's colours as linear RGB, not as sRGB."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
from toy_run import ns, toy_run

from dashboards.geometry.solids import Batch
from dashboards.model.containers.container_style import container_colours
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.palette import linear_rgb
from dashboards.viser_app.drawing.belief_marks import BeliefMarks

OURS = timeline_of(toy_run())


class Stand:
    """As much of a Viser scene as marks need."""

    def add_label(self, *_: object, **__: object) -> Any:
        return SimpleNamespace()

    add_batched_meshes_simple = add_label


def box(owners: int) -> Batch:
    """A box for each container."""
    grey = np.full((owners, 3), 90, dtype=np.uint8)
    zeros = np.zeros((owners, 3), dtype=np.float32)
    owner = np.arange(owners, dtype=np.int32)
    return Batch(shape="box", centre=zeros, size_m=zeros, yaw_rad=zeros[:, 0], colour=grey, owner=owner)


def srgb(light: npt.NDArray[np.uint8]) -> npt.NDArray[np.float64]:
    """What a screen shows of shares of light (IEC 61966-2-1)."""
    share = light / 255
    return 255 * np.where(share <= 0.0031308, share * 12.92, 1.055 * share ** (1 / 2.4) - 0.055)


def test_half_of_what_a_screen_can_show_is_a_fifth_of_its_light() -> None:
    """By hand: ((128 / 255 + 0.055) / 1.055) ** 2.4 = 0.2159."""
    assert linear_rgb(np.array([0, 128, 255], dtype=np.uint8)).tolist() == [0, 55, 255]


def test_a_container_is_sent_so_that_it_looks_as_the_legend_says() -> None:
    furniture = SimpleNamespace(batched_colors=None)
    plan, scene = OURS.plan, scene_at(OURS, ns(1.0))
    count = len(plan.containers)
    tops = [(0.0, 0.0, 1.0)] * count
    marks = BeliefMarks(Stand(), plan, tops, [(box(count), furniture)])  # type: ignore[arg-type,list-item]
    marks.show([scene], np.zeros(count, dtype=np.bool_))
    assert furniture.batched_colors is not None
    assert np.abs(srgb(furniture.batched_colors) - container_colours(scene)).max() < 8
