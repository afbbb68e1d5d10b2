"""Camera pictures, JPEG and PNG as received, with the camera's pose and field of view where known."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan
from typing import TYPE_CHECKING, Any

import numpy as np

from dashboards.sensing.frames import Frames, spot_pose
from workbench.arrays import Floats, Uints8

if TYPE_CHECKING:
    from PIL.Image import Image

MAX_BYTES = 8 << 20
MAX_PX = 4096
SHOWN_PX = 480
"""Width of a picture in the 3D view, in pixels."""
USUAL_FIELD_RAD = 1.2
"""Vertical field of view of a camera without a calibration in the log."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """One picture.

    Attributes:
        topic: topic of its camera; stamp_ns: when it was logged, in nanoseconds since the epoch.
        mime: image/jpeg or image/png; data: the file as it came.
        on_map: map_from_camera (z forward, x right, y down), or None where unknown.
        field_rad: vertical angle of view; aspect: width over height.
    """

    topic: str
    stamp_ns: int
    mime: str
    data: bytes
    on_map: Floats | None
    field_rad: float
    aspect: float

    @property
    def camera(self) -> str:
        """The last part of the topic."""
        return self.topic.rstrip("/").rpartition("/")[2]


def mime_of(data: bytes) -> str | None:
    """The MIME type by the first bytes, whatever the message says; None if neither JPEG nor PNG, or far too large."""
    if len(data) > MAX_BYTES:
        return None
    if data[:3] == b"\xff\xd8\xff":
        return "image/jpeg"
    return "image/png" if data[:8] == b"\x89PNG\r\n\x1a\n" else None


def picture_of(
    message: Any, topic: str, stamp_ns: int, frames: Frames, *, lens: Any | None, raw: Any | None
) -> Picture | None:
    """A foxglove.CompressedImage.

    Args:
        lens: the camera's foxglove.CameraCalibration.
        raw: the bosdyn.api.ImageResponse of the same camera, which holds the camera's pose.
    """
    mime = mime_of(message.data)
    if mime is None:
        return None
    wide, high = (lens.width, lens.height) if lens is not None else (0, 0)
    focal = lens.K[4] if lens is not None and len(lens.K) == 9 else 0.0
    known = focal > 0 and wide > 0 and high > 0
    return Picture(
        topic=topic,
        stamp_ns=stamp_ns,
        mime=mime,
        data=message.data,
        on_map=_place(message.frame_id, stamp_ns, frames, raw),
        field_rad=2 * atan(high / 2 / focal) if known else USUAL_FIELD_RAD,
        aspect=wide / high if known else 4 / 3,
    )


def pixels(picture: Picture) -> Uints8 | None:
    """The picture small enough for the 3D view, uint8 (rows, columns, 3); None when it cannot be decoded.

    Of grey pixels of 16 bits the upper eight are shown.
    """
    import io

    from PIL import Image

    try:
        with Image.open(io.BytesIO(picture.data), formats=("JPEG", "PNG")) as image:
            if max(image.size) > MAX_PX:
                return None
            image.draft("RGB", (SHOWN_PX, SHOWN_PX))
            shown = _eight_bits(image) if image.mode.startswith("I") else image
            shown.thumbnail((SHOWN_PX, SHOWN_PX))
            return np.asarray(shown.convert("RGB"), dtype=np.uint8)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


def _eight_bits(image: Image) -> Image:
    """A grey picture of 16 bits with the upper eight of each pixel: Pillow's own conversion cuts off at 255."""
    from PIL import Image

    return Image.fromarray((np.asarray(image, dtype=np.uint32) >> 8).astype(np.uint8))


def _place(frame: str, stamp_ns: int, frames: Frames, raw: Any | None) -> Floats | None:
    found = frames.on_map(frame, stamp_ns) if frame else None
    if found is not None or raw is None:
        return found
    sensor = spot_pose(raw.shot.transforms_snapshot, raw.shot.frame_name_image_sensor, "odom")
    map_from_odom = frames.on_map("odom", stamp_ns)
    return None if sensor is None or map_from_odom is None else map_from_odom @ sensor
