"""Detection of AprilTags and of tags of ar_track_alvar in pictures, with OpenCV's aruco module."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from bosdyn.client.math_helpers import Quat, SE3Pose

from recorders.spot.tags.alvar import BORDER, alvar_dictionary
from recorders.spot.tags.detections import TagStatus
from recorders.spot.tags.lens import Lens, LensModel
from workbench.arrays import Floats, Uints8
from workbench.errors import MissingExtra
from workbench.worlds.sites.survey_schema import ROBOT_TAG_M

MAX_ERROR_PX = 2.0
"""Root mean square of the corners beyond which a pose is of high error."""
AMBIGUOUS_RATIO, AMBIGUOUS_RAD, SURE_PX = 2.0, 0.35, 0.05
"""A pose is ambiguous if the other one that a square allows is turned by more than AMBIGUOUS_RAD and fits less than
AMBIGUOUS_RATIO times as badly; errors below SURE_PX count as that."""
MAX_PIXELS = 50_000_000
HALF_A_TURN = 2
"""Corners: OpenCV holds each tag of the AprilTag families turned by half a turn, so that the corner that it names
first is the lower right one of a tag that stands upright."""
CENTRE_PX = 0.5
"""Corners refined by AprilTag's method have the centre of the first pixel at (0.5, 0.5), lenses have it at (0, 0):
findings/opencv-apriltag-corners-half-a-pixel.sh."""
OUT_OF_THE_PAGE = np.diag([1.0, -1.0, -1.0])
"""From y down and z into the page to y up and z out of it."""
QUARTERS = (np.eye(3), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
"""Back from a square that is laid from its second corner."""
ALVAR = "alvar"
"""The family of ar_track_alvar's tags."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TagInPicture:
    """A tag found in a picture.

    Attributes:
        camera_tform_tag: camera: x right, y down, z ahead; tag: x right, y up, z out of the page, of an upright tag.
        error_px: root mean square distance of the corners from where the pose puts them.
    """

    tag: int
    camera_tform_tag: SE3Pose
    status: TagStatus
    error_px: float
    size_m: float


def require_opencv() -> Any:
    """OpenCV, which has no types here.

    Raises:
        MissingExtra: it is not installed, or without its aruco module.
    """
    try:
        import cv2
    except ImportError as error:
        raise MissingExtra("The detector opencv", "opencv") from error
    if not hasattr(getattr(cv2, "aruco", None), "ArucoDetector"):
        raise MissingExtra("The detector opencv", "opencv")
    return cv2


def decode_grey(data: bytes) -> Uints8 | None:
    """A JPEG or PNG as grey values, shape (rows, columns); None if it is none, or larger than MAX_PIXELS."""
    import io

    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=("JPEG", "PNG")) as image:
            if image.width * image.height > MAX_PIXELS:
                return None
            return np.asarray(image.convert("L"))
    except (OSError, ValueError, Image.DecompressionBombError):
        return None


def detect_tags(
    picture: Uints8, lens: Lens, *, family: str, sizes_m: Mapping[int, float]
) -> tuple[TagInPicture, ...]:
    """The tags in a picture, by number.

    Args:
        picture: grey values, shape (rows, columns).
        family: of the AprilTags, 36h11, 36h10, 25h9 or 16h5; or ALVAR.
        sizes_m: sides of the black squares; others have ROBOT_TAG_M.

    Raises:
        MissingExtra: OpenCV is not installed.
    """
    cv2 = require_opencv()
    if not lens.is_known:
        return ()
    return tuple(sorted(_found(cv2, picture, lens, family, sizes_m), key=lambda seen: seen.tag))


def _found(
    cv2: Any, picture: Uints8, lens: Lens, family: str, sizes_m: Mapping[int, float]
) -> Iterator[TagInPicture]:
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_APRILTAG
    if family == ALVAR:
        known, settings.markerBorderBits, turned = alvar_dictionary(cv2), BORDER, 0
    else:
        known, turned = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}")), HALF_A_TURN
    corners, numbers, _ = cv2.aruco.ArucoDetector(known, settings).detectMarkers(np.ascontiguousarray(picture))
    for quad, number in zip(corners, () if numbers is None else numbers.ravel().tolist(), strict=True):
        size_m = sizes_m.get(number, ROBOT_TAG_M)
        upright = np.roll(np.asarray(quad, dtype=np.float64).reshape(4, 2) - CENTRE_PX, turned, axis=0)
        seen = _pose(cv2, upright, lens, size_m)
        if seen is not None:
            pose, status, error_px = seen
            yield TagInPicture(tag=number, camera_tform_tag=pose, status=status, error_px=error_px, size_m=size_m)


def _pose(cv2: Any, quad: Floats, lens: Lens, size_m: float) -> tuple[SE3Pose, TagStatus, float] | None:
    """The pose of a square, from its corners, clockwise from the tag's upper left: the better of the two that it
    allows."""
    fits = _fits(cv2, _undistorted(cv2, quad, lens), size_m, (lens.fx + lens.fy) / 2)
    if not fits:
        return None
    error_px, rotation, at = fits[0]
    pose = SE3Pose(x=float(at[0]), y=float(at[1]), z=float(at[2]), rot=Quat.from_matrix(rotation))
    return pose, _status(fits), error_px


def _fits(cv2: Any, ahead: Floats, size_m: float, focal: float) -> list[tuple[float, Floats, Floats]]:
    """The two poses that a square allows, as error, rotation and place, the better one first.

    OpenCV's method for squares fails for rotations of half a turn, as those of tags that face the camera exactly are
    (findings/opencv-pose-of-a-facing-tag.sh). The square is therefore laid into the page, once from each of two
    corners, and the better answer taken; where there is none, that of another method.
    """
    half = size_m / 2
    square = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]], dtype=np.float64)
    answers: list[list[tuple[float, Floats, Floats]]] = []
    for method, corner in ((cv2.SOLVEPNP_IPPE, 0), (cv2.SOLVEPNP_IPPE, 1), (cv2.SOLVEPNP_ITERATIVE, 0)):
        if method == cv2.SOLVEPNP_ITERATIVE and answers:
            break
        points = np.roll(ahead, -corner, axis=0).reshape(4, 1, 2)
        _, turns, shifts, errors = cv2.solvePnPGeneric(square, points, np.eye(3), None, flags=method)
        upright = QUARTERS[corner] @ OUT_OF_THE_PAGE
        fits = [
            (float(np.ravel(error)[0]) * focal, cv2.Rodrigues(turn)[0] @ upright, np.ravel(shift))
            for turn, shift, error in zip(turns, shifts, errors, strict=True)
            if np.isfinite(turn).all() and np.isfinite(shift).all() and np.ravel(shift)[2] > 0
        ]
        answers += [sorted(fits, key=lambda fit: fit[0])] if fits else []
    return min(answers, key=lambda fits: fits[0][0], default=[])


def _status(fits: list[tuple[float, Floats, Floats]]) -> TagStatus:
    best = max(fits[0][0], SURE_PX)
    if fits[0][0] > MAX_ERROR_PX:
        return TagStatus.HIGH_ERROR
    if len(fits) > 1 and fits[1][0] < AMBIGUOUS_RATIO * best:
        turned = float(np.arccos(np.clip(fits[0][1][:, 2] @ fits[1][1][:, 2], -1.0, 1.0)))
        if turned > AMBIGUOUS_RAD:
            return TagStatus.AMBIGUOUS
    return TagStatus.OK


def _undistorted(cv2: Any, quad: Floats, lens: Lens) -> Floats:
    """Corners in pixels as points at distance 1 ahead of the camera, shape (4, 2)."""
    points, matrix = quad.reshape(4, 1, 2), lens.matrix()
    coefficients = np.array(lens.coefficients, dtype=np.float64)
    if lens.model is LensModel.KANNALA_BRANDT:
        straight = cv2.fisheye.undistortPoints(points, matrix, coefficients)
    else:
        straight = cv2.undistortPoints(points, matrix, coefficients if len(coefficients) else None)
    return np.asarray(straight, dtype=np.float64).reshape(4, 2)
