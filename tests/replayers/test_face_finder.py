"""Faces found upright and sideways in a picture in the public domain that comes with Matplotlib, and made coarse."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import cbook
from PIL import Image

from replayers.log_tools.faces.face_finder import FaceFinder, NoCascades
from workbench.arrays import Uints8
from workbench.errors import MissingExtra


def hopper() -> Uints8:
    """Grace Hopper, photographed by the US Navy: rows 150, columns 128, the face in the middle."""
    with Image.open(cbook.get_sample_data("grace_hopper.jpg", asfileobj=False)) as image:
        return np.asarray(image.convert("RGB").resize((128, 150)))


@pytest.fixture(scope="module")
def finder() -> FaceFinder:
    pytest.importorskip("cv2", reason="the extra opencv is not installed")
    return FaceFinder()


@pytest.mark.parametrize("quarter", [0, 1, 2, 3])
def test_a_face_is_found_however_the_camera_is_mounted(finder: FaceFinder, quarter: int) -> None:
    picture = hopper()
    mask = np.zeros(picture.shape[:2], dtype=bool)
    mask[38:75, 50:85] = True
    turned, face = np.ascontiguousarray(np.rot90(picture, quarter)), np.rot90(mask, quarter)
    covered = np.zeros(face.shape, dtype=bool)
    for left, top, width, height in finder.boxes(turned):
        covered[top : top + height, left : left + width] = True
    assert (covered & face).sum() > 0.95 * face.sum()
    assert covered.mean() < 0.6


def test_a_blurred_face_is_no_face_any_more(finder: FaceFinder) -> None:
    picture = hopper()
    boxes = finder.boxes(picture)
    blurred = finder.blurred(picture, boxes)
    assert finder.boxes(blurred) == ()
    left, top, width, height = boxes[0]
    assert np.array_equal(blurred[: top // 2], picture[: top // 2])
    colours = {tuple(pixel) for pixel in blurred[top : top + height, left : left + width].reshape(-1, 3)}
    assert len(colours) <= 16 * len(boxes)


def test_where_nobody_is_nothing_is_found(finder: FaceFinder) -> None:
    ramp = np.tile(np.linspace(0, 255, 320).astype(np.uint8), (240, 1))
    assert finder.boxes(ramp) == ()
    assert finder.boxes(np.zeros((3, 5), dtype=np.uint8)) == ()


def test_an_opencv_without_cascades_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", SimpleNamespace(__version__="5.0.0"))
    with pytest.raises(NoCascades, match="below 5"):
        FaceFinder()
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingExtra, match=r"lios-workbench\[opencv\]"):
        FaceFinder()
