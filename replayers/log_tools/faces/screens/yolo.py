"""Screens by a network of the YOLO family in an ONNX file of the user's, trained on COCO's 80 classes.

Two layouts of the output are known, by their shapes, for an input of S by S pixels:

- (1, 84, N), as YOLOv8 and its successors export: middle, width and height in pixels of the input, and a score for
  each class. The input is red, green, blue from 0 to 1.
- (1, N, 85) with N = (S/8)^2 + (S/16)^2 + (S/32)^2, as YOLOX exports it (Ge and others, 2021): middle and size by
  cells of the three grids, the size as a logarithm, whether there is an object, and a score for each class. The input
  is blue, green, red from 0 to 255.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, final

import numpy as np

from replayers.log_tools.faces.face_finder import Box
from replayers.log_tools.faces.screens.center_net import LEAST_SCORE, SCREENS
from replayers.log_tools.faces.screens.onnx_model import input_shape, unmade_input
from workbench.arrays import Floats, Uints8
from workbench.errors import Malformed

CLASSES = 80
STRIDES = (8, 16, 32)
OPEN_SIDE = 640
"""The side of the input where the model leaves it open."""
MAX_SIDE = 4096
MAX_NAME = 60
"""Characters of a name that are told."""
LONGEST = 10.0
"""The largest logarithm of a size in cells that is believed."""
PADDING = 114
"""The grey beside a picture that is not square."""


class UnknownModel(Malformed):
    """An ONNX file that is no detector of a known layout."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(
            f"{path}: {reason}. Known are YOLOv8's (1, 84, N) and YOLOX's (1, N, 85), on COCO's classes."
        )


@final
class Yolo:
    """Finds screens in one upright picture.

    Args:
        cv2: OpenCV. path: the ONNX file.

    Raises:
        UnknownModel: OpenCV cannot run it, or its input or output is of another shape, or its output not finite.
    """

    def __init__(self, cv2: Any, path: Path) -> None:
        data = path.read_bytes()
        try:
            shape, unmade = input_shape(data), unmade_input(data)
        except ValueError as error:
            raise UnknownModel(path, f"it cannot be read as ONNX ({error})") from error
        if unmade is not None:
            raise UnknownModel(path, f"a node takes {unmade[:MAX_NAME]!r}, which nothing before it makes")
        rows, columns = (side or OPEN_SIDE for side in shape[2:]) if len(shape) == 4 else (0, 0)
        if len(shape) != 4 or shape[1] not in (0, 3) or rows != columns or rows % STRIDES[-1] or rows > MAX_SIDE:
            raise UnknownModel(
                path, f"its input has the shape {shape}: not a square picture of at most {MAX_SIDE} pixels"
            )
        self._cv2, self._side = cv2, rows
        self._grid = _cells(self._side)
        try:
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(data, dtype=np.uint8))
            outputs = self._net.getUnconnectedOutLayersNames()
            self._output = outputs[0]
            tried = self._forward(np.zeros((rows, rows, 3), dtype=np.uint8), grids=False)
        except cv2.error as error:
            raise UnknownModel(path, "OpenCV cannot run it") from error
        found = tried.shape
        self._grids = found == (1, len(self._grid), 5 + CLASSES)
        if len(outputs) != 1 or not (self._grids or (len(found) == 3 and found[:2] == (1, 4 + CLASSES))):
            raise UnknownModel(path, f"it has {len(outputs)} outputs, the first with the shape {found}")
        if not np.isfinite(tried).all():
            raise UnknownModel(path, "its output for a black picture is not finite")

    def __call__(self, picture: Uints8) -> list[Box]:
        """Boxes of screens, unsorted, several around one among them.

        Args:
            picture: colours, shape (rows, columns, 3).
        """
        scale = self._side / max(picture.shape[:2])
        size = (max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale)))
        given = np.full((self._side, self._side, 3), PADDING, dtype=np.uint8)
        given[: size[1], : size[0]] = self._cv2.resize(picture, size, interpolation=self._cv2.INTER_LINEAR)
        found = self._forward(given, grids=self._grids)[0].astype(np.float64)
        places, scores = self._by_grids(found) if self._grids else (found[:4].T, found[4:].T)
        likely = (scores[:, list(SCREENS)].max(axis=1) >= LEAST_SCORE) & np.isfinite(places).all(axis=1)
        return [_box(place / scale, picture.shape) for place in places[likely]]

    def _by_grids(self, found: Floats) -> tuple[Floats, Floats]:
        """Middles and sizes in pixels of the input, shape (N, 4), and scores, shape (N, 80)."""
        corner, stride = self._grid[:, :2], self._grid[:, 2:]
        places = np.hstack([(found[:, :2] + corner) * stride, np.exp(np.minimum(found[:, 2:4], LONGEST)) * stride])
        return places, found[:, 4:5] * found[:, 5:]

    def _forward(self, picture: Uints8, *, grids: bool) -> Any:
        factor = 1.0 if grids else 1.0 / 255
        self._net.setInput(self._cv2.dnn.blobFromImage(picture, factor, swapRB=grids))
        return self._net.forward(self._output)


def _cells(side: int) -> Floats:
    """Column, row and stride of each cell of the three grids, shape (N, 3)."""
    grids = list[Floats]()
    for stride in STRIDES:
        rows, columns = np.indices((side // stride, side // stride)).reshape(2, -1)
        grids.append(np.stack([columns, rows, np.full(rows.shape, stride)], axis=1).astype(np.float64))
    return np.concatenate(grids)


def _box(place: Floats, shape: tuple[int, ...]) -> Box:
    """The part of a picture around a middle with a width and a height; what is beyond its edges is left out."""
    middle, half = place[:2], place[2:] / 2
    left, top = (max(0, round(float(side))) for side in middle - half)
    right, bottom = (min(round(float(side)), most) for side, most in zip(middle + half, shape[1::-1], strict=False))
    return left, top, max(1, right - left), max(1, bottom - top)
