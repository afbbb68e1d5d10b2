"""The lens of a camera of Spot, from its image source, scaled to the size of a picture."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from bosdyn.api import image_pb2

from workbench.arrays import Floats


class LensModel(StrEnum):
    """How a lens bends what a pinhole would show (image.proto)."""

    PINHOLE = "pinhole"
    BROWN_CONRADY = "brown-conrady"
    KANNALA_BRANDT = "kannala-brandt"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """Focal lengths and principal point in pixels of a picture, and the distortion.

    Pixels are counted by their index, as the SDK and ROS do: the centre of the first one is at 0.

    Attributes:
        coefficients: k1, k2, p1, p2, k3 of Brown and Conrady, k1 to k4 of Kannala and Brandt; none of a pinhole.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    model: LensModel = LensModel.PINHOLE
    coefficients: tuple[float, ...] = ()

    @property
    def is_known(self) -> bool:
        """Whether the robot reported it: image sources without intrinsics have zeros."""
        return self.fx > 0 and self.fy > 0

    def matrix(self) -> Floats:
        """The camera matrix, shape (3, 3)."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]], dtype=np.float64)


def lens_of(source: image_pb2.ImageSource, columns: int, rows: int) -> Lens:
    """The lens of an image source for a picture of this size; scaling keeps the edge of the picture where it is."""
    wide = columns / source.cols if source.cols else 1.0
    high = rows / source.rows if source.rows else 1.0
    model, coefficients, pinhole = LensModel.PINHOLE, (), source.pinhole.intrinsics
    if source.HasField("pinhole_brown_conrady"):
        brown = source.pinhole_brown_conrady.intrinsics
        model, pinhole = LensModel.BROWN_CONRADY, brown.pinhole_intrinsics
        coefficients = (brown.k1, brown.k2, brown.p1, brown.p2, brown.k3)
    elif source.HasField("kannala_brandt"):
        kannala = source.kannala_brandt.intrinsics
        model, pinhole = LensModel.KANNALA_BRANDT, kannala.pinhole_intrinsics
        coefficients = (kannala.k1, kannala.k2, kannala.k3, kannala.k4)
    return Lens(
        fx=pinhole.focal_length.x * wide,
        fy=pinhole.focal_length.y * high,
        cx=(pinhole.principal_point.x + 0.5) * wide - 0.5,
        cy=(pinhole.principal_point.y + 0.5) * high - 0.5,
        model=model,
        coefficients=coefficients,
    )
