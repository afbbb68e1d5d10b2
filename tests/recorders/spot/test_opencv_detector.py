"""Our detector of tags, on pictures drawn here by an own pinhole model with a known pose."""

from __future__ import annotations

import io
import sys

import numpy as np
import pytest
from bosdyn.api import image_pb2
from bosdyn.client.math_helpers import Quat, SE3Pose
from PIL import Image

from recorders.spot.tags.alvar import alvar_code
from recorders.spot.tags.detections import TagStatus
from recorders.spot.tags.lens import Lens, LensModel, lens_of
from recorders.spot.tags.opencv_detector import decode_grey, detect_tags
from workbench.arrays import Floats, Uints8
from workbench.errors import MissingExtra

cv2 = pytest.importorskip("cv2", reason="the extra opencv is not installed")

PINHOLE = Lens(fx=330.0, fy=330.0, cx=319.5, cy=239.5)
FISHEYE = Lens(
    fx=330.0, fy=330.0, cx=319.5, cy=239.5, model=LensModel.KANNALA_BRANDT, coefficients=(0.1, -0.05, 0.02, -0.004)
)
BARREL = Lens(
    fx=330.0, fy=330.0, cx=319.5, cy=239.5, model=LensModel.BROWN_CONRADY, coefficients=(-0.2, 0.05, 0, 0, 0)
)
GROUND = 120
FACING = Quat.from_matrix(np.diag([1.0, -1.0, -1.0]))
"""An upright tag straight ahead: x to the right, y up, z towards the camera."""


def pixel_rays(lens: Lens, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Where rays of pixels meet the plane at distance 1, by the inverse of the lens's model."""
    points = np.stack([u.ravel(), v.ravel()], axis=1).reshape(-1, 1, 2)
    coefficients = np.array(lens.coefficients, dtype=np.float64)
    if lens.model is LensModel.KANNALA_BRANDT:
        flat = cv2.fisheye.undistortPoints(points, lens.matrix(), coefficients)
    else:
        flat = cv2.undistortPoints(points, lens.matrix(), coefficients if len(coefficients) else None)
    return flat[:, 0, 0].reshape(u.shape), flat[:, 0, 1].reshape(u.shape)


def picture_of(number: int, size_m: float, pose: SE3Pose, lens: Lens = PINHOLE, family: str = "36h11") -> Uints8:
    """A picture of 640 by 480 of one tag on grey ground: where a first picture of every other pixel shows the tag,
    four by four rays a pixel."""
    if family == "alvar":
        upright = np.pad(alvar_code(number) * 255, 2)
    else:
        known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}"))
        upright = np.rot90(cv2.aruco.generateImageMarker(known, number, known.markerSize + 2), 2)
    bits, size_m = np.pad(upright, 1, constant_values=255), size_m * (len(upright) + 2) / len(upright)
    first = _greys(bits, size_m, pose, pixel_rays(lens, *np.meshgrid(np.arange(0.0, 640, 2), np.arange(0.0, 480, 2))))
    rows, columns = np.nonzero(first != GROUND)
    top, left = np.maximum(2 * np.array([rows.min(), columns.min()]) - 3, 0)
    bottom, right = np.minimum(2 * np.array([rows.max(), columns.max()]) + 4, (480, 640))
    fine = (np.arange(4) + 0.5) / 4 - 0.5
    u, v = ((np.arange(low, high)[:, None] + fine).ravel() for low, high in ((left, right), (top, bottom)))
    greys = _greys(bits, size_m, pose, pixel_rays(lens, *np.meshgrid(u, v)))
    picture = np.full((480, 640), GROUND, dtype=np.uint8)
    picture[top:bottom, left:right] = greys.reshape(bottom - top, 4, right - left, 4).mean(axis=(1, 3)).round()
    return picture


def _greys(bits: Uints8, size_m: float, pose: SE3Pose, rays: tuple[Floats, Floats]) -> Floats:
    """The grey value that each ray meets on the plane of a tag with its white border, which is so large."""
    rotation = pose.rot.to_matrix()
    plane = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], [pose.x, pose.y, pose.z]]))
    along, up, scale = np.tensordot(plane, np.stack([*rays, np.ones_like(rays[0])]), axes=1)
    module, half = size_m / len(bits), size_m / 2
    column = np.floor((along / scale + half) / module).astype(int)
    row = np.floor((half - up / scale) / module).astype(int)
    inside = (row >= 0) & (row < len(bits)) & (column >= 0) & (column < len(bits))
    return np.where(inside, bits[row * inside, column * inside], GROUND).astype(float)


def turned(axis: tuple[float, float, float], angle_rad: float) -> Quat:
    s = np.sin(angle_rad / 2)
    return FACING * Quat(w=np.cos(angle_rad / 2), x=axis[0] * s, y=axis[1] * s, z=axis[2] * s)


@pytest.mark.ci_but(1)
@pytest.mark.parametrize(
    ("lens", "axis", "angle_rad"),
    [
        (PINHOLE, (0, 1, 0), 0.7),
        (PINHOLE, (1, 0, 0), -0.7),
        (FISHEYE, (0, 1, 0), -0.7),
        (BARREL, (0, 0, 1), 1.2),
    ],
    ids=("turned", "leaning", "fisheye", "barrel"),
)
def test_a_drawn_tag_is_found_where_it_was_drawn(
    lens: Lens, axis: tuple[float, float, float], angle_rad: float
) -> None:
    pose = SE3Pose(x=0.2, y=-0.1, z=0.7, rot=turned(axis, angle_rad))
    (seen,) = detect_tags(picture_of(101, 0.1, pose, lens), lens, family="36h11", sizes_m={101: 0.1})
    found = seen.camera_tform_tag
    assert (seen.tag, seen.status) == (101, TagStatus.OK)
    assert [found.x, found.y, found.z] == pytest.approx([0.2, -0.1, 0.7], abs=0.012)
    apart = (found.rot.inverse() * pose.rot).w
    assert 2 * np.degrees(np.arccos(min(1.0, abs(apart)))) < 4
    assert seen.error_px < 0.5


@pytest.mark.parametrize("quarters", range(4))
def test_a_tag_that_faces_the_camera_exactly_stands_as_the_apriltag_library_says(quarters: int) -> None:
    """The family's own code of tag 0, row by row, not OpenCV's picture (findings/opencv-apriltags-upside-down.sh),
    in the middle and aside: OpenCV's poses of such squares are wrong (findings/opencv-pose-of-a-facing-tag.sh)."""
    bits = np.array([int(bit) for bit in f"{0xD5D628584:036b}"], dtype=np.uint8).reshape(6, 6) * 255
    tag = np.pad(np.pad(bits, 1), 1, constant_values=255).repeat(24, axis=0).repeat(24, axis=1)
    roll = Quat.from_yaw(quarters * np.pi / 2)
    for top, left in ((120, 200), (40, 350)):
        around = ((top, 240 - top), (left, 400 - left))
        picture = np.pad(np.rot90(tag, quarters), around, constant_values=120)
        (seen,) = detect_tags(np.ascontiguousarray(picture), PINHOLE, family="36h11", sizes_m={0: 0.1})
        apart = seen.camera_tform_tag.rot.inverse().mult(FACING).mult(roll).w
        assert (seen.tag, seen.status) == (0, TagStatus.OK)
        assert 2 * np.degrees(np.arccos(min(1.0, abs(apart)))) < 4


@pytest.mark.parametrize("family", ["36h11", "alvar"])
def test_no_direction_is_preferred(family: str) -> None:
    """Pixels are counted from their centres (findings/opencv-apriltag-corners-half-a-pixel.sh): over several tags,
    errors of half a pixel to the right and down do not remain."""
    off = []
    for number, (x, y, angle_rad) in enumerate(
        [(-0.2, -0.1, 0.5), (0.2, 0.1, -0.6), (-0.1, 0.2, 0.6), (0.1, -0.15, -0.5)]
    ):
        pose = SE3Pose(x=x, y=y, z=0.8, rot=turned((0, 1, 0), angle_rad))
        (seen,) = detect_tags(
            picture_of(number, 0.15, pose, family=family), PINHOLE, family=family, sizes_m={number: 0.15}
        )
        found = seen.camera_tform_tag
        off.append([found.x / found.z - x / pose.z, found.y / found.z - y / pose.z])
    assert np.abs(np.mean(off, axis=0) * PINHOLE.fx).max() < 0.2


def test_half_the_size_is_half_the_distance() -> None:
    picture = picture_of(7, 0.1, SE3Pose(x=0.0, y=0.0, z=0.8, rot=turned((0, 1, 0), 0.6)))
    (seen,) = detect_tags(picture, PINHOLE, family="36h11", sizes_m={7: 0.05})
    assert seen.camera_tform_tag.z == pytest.approx(0.4, abs=0.01)


def test_families_are_told_apart() -> None:
    picture = picture_of(3, 0.1, SE3Pose(x=0.0, y=0.0, z=0.5, rot=FACING), family="25h9")
    assert detect_tags(picture, PINHOLE, family="36h11", sizes_m={}) == ()
    (seen,) = detect_tags(picture, PINHOLE, family="25h9", sizes_m={3: 0.1})
    assert seen.tag == 3
    assert seen.camera_tform_tag.z == pytest.approx(0.5, abs=0.01)


def test_a_small_tag_far_away_may_face_two_ways() -> None:
    picture = picture_of(7, 0.146, SE3Pose(x=0.0, y=0.0, z=2.2, rot=turned((0, 1, 0), 0.35)))
    (seen,) = detect_tags(picture, PINHOLE, family="36h11", sizes_m={7: 0.146})
    assert seen.status is TagStatus.AMBIGUOUS
    assert seen.camera_tform_tag.z == pytest.approx(2.2, abs=0.06)


def test_without_a_lens_nothing_can_be_placed() -> None:
    picture = picture_of(7, 0.1, SE3Pose(x=0.0, y=0.0, z=0.5, rot=FACING))
    unknown = lens_of(image_pb2.ImageSource(cols=640, rows=480), 640, 480)
    assert detect_tags(picture, unknown, family="36h11", sizes_m={7: 0.1}) == ()


def test_the_lens_is_that_of_the_image_source_whatever_its_model() -> None:
    source = image_pb2.ImageSource(cols=640, rows=480)
    lens = source.kannala_brandt.intrinsics
    lens.pinhole_intrinsics.focal_length.x = lens.pinhole_intrinsics.focal_length.y = 300
    lens.k1, lens.k4 = 0.1, 0.4
    read = lens_of(source, 320, 240)
    assert (read.model, read.fx, read.coefficients[0], read.coefficients[3]) == (
        LensModel.KANNALA_BRANDT,
        150,
        pytest.approx(0.1),
        pytest.approx(0.4),
    )


def test_pictures_are_decoded_or_left() -> None:
    grey = np.full((24, 32), 77, dtype=np.uint8)
    stream = io.BytesIO()
    Image.fromarray(grey).save(stream, "PNG")
    decoded = decode_grey(stream.getvalue())
    assert decoded is not None
    assert np.array_equal(decoded, grey)
    for data in (b"", b"\xff\xd8\xff nothing", stream.getvalue()[:40]):
        assert decode_grey(data) is None


def test_without_opencv_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingExtra, match=r"lios-workbench\[opencv\]"):
        detect_tags(np.zeros((4, 4), dtype=np.uint8), PINHOLE, family="36h11", sizes_m={})


@pytest.mark.parametrize("number", [0, 7, 170, 255])
@pytest.mark.parametrize("roll_rad", [0.0, 0.6, -1.9])
def test_a_tag_of_ar_track_alvar_is_read_and_placed_upright(number: int, roll_rad: float) -> None:
    pose = SE3Pose(x=0.1, y=-0.05, z=0.9, rot=turned((0.0, 0.0, 1.0), roll_rad))
    picture = picture_of(number, 0.2, pose, family="alvar")
    (seen,) = detect_tags(picture, PINHOLE, family="alvar", sizes_m={number: 0.2})
    assert seen.tag == number
    found = seen.camera_tform_tag
    assert (found.x, found.y, found.z) == pytest.approx((pose.x, pose.y, pose.z), abs=0.01)
    away = found.rot.inverse() * pose.rot
    assert abs(away.w) > 0.97, "not a quarter of a turn off: 0.71"
    assert detect_tags(picture, PINHOLE, family="36h11", sizes_m={number: 0.2}) == ()


def test_an_alvar_tag_with_a_wrong_square_is_not_guessed_at(monkeypatch: pytest.MonkeyPatch) -> None:
    pose, code = SE3Pose(x=0.0, y=0.0, z=0.9, rot=turned((0.0, 0.0, 1.0), 0.4)), alvar_code(93)
    code[0, 0] ^= 1
    monkeypatch.setattr(sys.modules[__name__], "alvar_code", lambda _: code)
    assert detect_tags(picture_of(93, 0.2, pose, family="alvar"), PINHOLE, family="alvar", sizes_m={93: 0.2}) == ()
