"""Faces in a picture, by the cascades that come with OpenCV (Viola and Jones, 2001), and their pixels made coarse."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, final

import numpy as np

from workbench.arrays import Uints8
from workbench.errors import MissingExtra, Unsupported

Box = tuple[int, int, int, int]
"""Left, top, width and height in pixels."""
FRONTAL = ("haarcascade_frontalface_default.xml", "haarcascade_frontalface_alt2.xml")
PROFILE = "haarcascade_profileface.xml"
SEARCHED_PX = 640
"""Longest side of the picture that is searched; larger ones are made smaller."""
MIN_FACE_PX, STEP, NEIGHBOURS = 24, 1.15, 3
"""Least size of a face in it, and how thoroughly and how leniently it is searched."""
BEYOND = 0.25
"""How far beyond the found box pixels are blurred, in its size on each side: hair, chin and ears."""
CELLS = 4
"""Cells across a blurred face."""


class NoCascades(Unsupported):
    """An OpenCV without its cascades: they left its wheels with version 5."""

    def __init__(self, version: str) -> None:
        super().__init__(
            f"OpenCV {version} has no face cascades. Install one below 5: pip install 'lios-workbench[opencv]'."
        )


@final
class FaceFinder:
    """Finds faces, upright and turned by quarters, since Spot's front cameras are mounted sideways.

    Raises:
        MissingExtra: OpenCV is not installed. NoCascades: it comes without cascades.
    """

    def __init__(self) -> None:
        try:
            import cv2
        except ImportError as error:
            raise MissingExtra("Blurring faces", "opencv") from error
        self._cv2: Any = cv2
        folder = Path(getattr(getattr(cv2, "data", None), "haarcascades", ""))
        files = [folder / name for name in (*FRONTAL, PROFILE)]
        if not hasattr(cv2, "CascadeClassifier") or not all(file.is_file() for file in files):
            raise NoCascades(str(cv2.__version__))
        *self._frontal, self._profile = (cv2.CascadeClassifier(str(file)) for file in files)

    def boxes(self, picture: Uints8) -> tuple[Box, ...]:
        """Where faces are, enlarged by BEYOND and cut at the edges; sorted.

        Args:
            picture: grey values, shape (rows, columns), or colours, shape (rows, columns, 3).
        """
        grey = picture if picture.ndim == 2 else self._cv2.cvtColor(picture, self._cv2.COLOR_RGB2GRAY)
        scale = min(1.0, SEARCHED_PX / max(grey.shape))
        if scale < 1.0:
            size = (max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale)))
            grey = self._cv2.resize(grey, size, interpolation=self._cv2.INTER_AREA)
        return boxes_of_turned(grey, range(4), self._upright, scale=scale, shape=picture.shape)

    def blurred(self, picture: Uints8, boxes: tuple[Box, ...]) -> Uints8:
        """The picture with these boxes in CELLS by CELLS cells, of which no face can be read."""
        return coarse(self._cv2, picture, boxes)

    def _upright(self, grey: Uints8) -> list[Box]:
        found = [box for cascade in (*self._frontal, self._profile) for box in self._by(cascade, grey)]
        mirrored = np.ascontiguousarray(grey[:, ::-1])
        width = grey.shape[1]
        return found + [(width - x - w, y, w, h) for x, y, w, h in self._by(self._profile, mirrored)]

    def _by(self, cascade: Any, grey: Uints8) -> list[Box]:
        found = cascade.detectMultiScale(grey, STEP, NEIGHBOURS, minSize=(MIN_FACE_PX, MIN_FACE_PX))
        return [(int(x), int(y), int(w), int(h)) for x, y, w, h in found]


def boxes_of_turned(
    searched: Uints8,
    quarters: Iterable[int],
    find: Callable[[Uints8], list[Box]],
    *,
    scale: float = 1.0,
    shape: tuple[int, ...] | None = None,
    beyond: float = BEYOND,
) -> tuple[Box, ...]:
    """What is found in a picture that is turned by quarters, in the picture as it is; enlarged, merged and sorted.

    Args:
        searched: the picture to search, shape (rows, columns) or (rows, columns, 3).
        scale: its size in that of the whole picture. shape: that of the whole picture; None for the same.
        beyond: how far boxes are enlarged, in their size on each side.
    """
    found: set[Box] = set()
    for quarter in quarters:
        turned = np.ascontiguousarray(np.rot90(searched, quarter))
        for box in find(turned):
            back = _turned_back(box, turned.shape, quarter)
            found.add(_enlarged(back, scale, shape or searched.shape, beyond))
    return tuple(sorted(_merged(found)))


def coarse(cv2: Any, picture: Uints8, boxes: Iterable[Box]) -> Uints8:
    """A copy of a picture with these boxes in CELLS by CELLS cells."""
    copy = picture.copy()
    for left, top, width, height in boxes:
        part = copy[top : top + height, left : left + width]
        if part.size:
            cells = cv2.resize(part, (CELLS, CELLS), interpolation=cv2.INTER_AREA)
            copy[top : top + height, left : left + width] = cv2.resize(
                cells, (part.shape[1], part.shape[0]), interpolation=cv2.INTER_NEAREST
            )
    return copy


def _merged(boxes: Iterable[Box]) -> list[Box]:
    """One box around those of which one covers most of the other: several cascades find one face."""
    merged: list[Box] = []
    for box in sorted(boxes, key=lambda b: (-b[2] * b[3], b)):
        for place, other in enumerate(merged):
            if _shared(box, other) > 0.5 * box[2] * box[3]:
                merged[place] = _around(box, other)
                break
        else:
            merged.append(box)
    return merged


def _shared(a: Box, b: Box) -> int:
    """The area in pixels that two boxes share."""
    wide = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    high = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    return max(0, wide) * max(0, high)


def _around(a: Box, b: Box) -> Box:
    left, top = min(a[0], b[0]), min(a[1], b[1])
    return left, top, max(a[0] + a[2], b[0] + b[2]) - left, max(a[1] + a[3], b[1] + b[3]) - top


def _turned_back(box: Box, shape: tuple[int, ...], quarters: int) -> Box:
    """A box in a picture that np.rot90 turned this many quarters, in the picture before."""
    x, y, w, h = box
    rows, columns = shape[0], shape[1]
    for _ in range(quarters):  # np.rot90 takes (row, column) to (columns - 1 - column, row)
        x, y, w, h = rows - y - h, x, h, w
        rows, columns = columns, rows
    return x, y, w, h


def _enlarged(box: Box, scale: float, shape: tuple[int, ...], beyond: float) -> Box:
    x, y, w, h = (side / scale for side in box)
    left, top = max(0, int(x - beyond * w)), max(0, int(y - beyond * h))
    right, bottom = min(shape[1], round(x + (1 + beyond) * w)), min(shape[0], round(y + (1 + beyond) * h))
    return left, top, max(0, right - left), max(0, bottom - top)
