"""Text in a picture, as on screens and papers, by PP-OCR's detector (RapidOCR), and its pixels made coarse."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from replayers.log_tools.faces.face_finder import Box, boxes_of_turned, coarse
from workbench.arrays import Uints8
from workbench.errors import MissingExtra

EXTRA = "text"
QUARTERS = (0, 1)
"""Turns in which a picture is searched: Spot's front cameras are mounted sideways."""


@final
class TextFinder:
    """Finds lines of text, level and upright ones. The weights come with the package: nothing is downloaded.

    Raises:
        MissingExtra: RapidOCR or what it runs on is not installed.
    """

    def __init__(self) -> None:
        try:
            import cv2
            import onnxruntime  # pyright: ignore[reportMissingImports] (RapidOCR runs on it and does not require it)
            from rapidocr import RapidOCR  # pyright: ignore[reportMissingImports] (not in the extra `test`)
        except ImportError as error:
            raise MissingExtra("Blurring text", EXTRA) from error
        self._cv2: Any = cv2
        self._runtime: Any = onnxruntime
        self._engine: Any = RapidOCR(params={"Global.log_level": "critical"})

    def boxes(self, picture: Uints8) -> tuple[Box, ...]:
        """Where text is, enlarged and cut at the edges; sorted.

        Args:
            picture: grey values, shape (rows, columns), or colours, shape (rows, columns, 3).
        """
        colours = picture if picture.ndim == 3 else np.repeat(picture[:, :, None], 3, axis=2)
        return boxes_of_turned(colours, QUARTERS, self._level)

    def blurred(self, picture: Uints8, boxes: tuple[Box, ...]) -> Uints8:
        """The picture with these boxes in a few cells, of which no text can be read."""
        return coarse(self._cv2, picture, boxes)

    def _level(self, picture: Uints8) -> list[Box]:
        found = self._engine(picture[:, :, ::-1], use_det=True, use_cls=False, use_rec=False)
        quads = getattr(found, "boxes", None)
        return [] if quads is None else [_around(np.asarray(quad, dtype=np.float64)) for quad in quads]


def _around(quad: Any) -> Box:
    left, top = np.floor(quad.min(axis=0)).astype(int).tolist()
    right, bottom = np.ceil(quad.max(axis=0)).astype(int).tolist()
    return left, top, right - left, bottom - top
