"""Pictures, clouds and grids of a robot's log: read by index or by a walk, placed on the map, rejected when
inconsistent.

The hand-made log: the robot's odom stands at (10, 0) on the map and is turned by 90 degrees left; its body is 1 m
ahead in odom, so at (10, 1) on the map.
"""

from __future__ import annotations

import io
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from mcap_protobuf.writer import Writer
from PIL import Image

from dashboards.panels.cameras import cameras
from dashboards.sensing.clouds import NOTHING, cloud_points
from dashboards.sensing.frames import Frames, matrix
from dashboards.sensing.grids import grid_cells
from dashboards.sensing.pictures import Picture, mime_of, pixels
from dashboards.sensing.robot_sensors import RobotSensors, sensors_of
from replayers.runs.sensor_index import sensor_tracks
from workbench.errors import NotFound

LOGS = Path(__file__).resolve().parents[2] / "logs"
SPOT = LOGS / "spot-home-A.mcap"
SECOND = 1_000_000_000


def jpeg(shade: int = 120) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (64, 48), (shade, shade, shade)).save(stream, "JPEG")
    return stream.getvalue()


def transforms() -> FrameTransforms:
    turned = Quaternion(z=sin(pi / 4), w=cos(pi / 4))
    return FrameTransforms(
        transforms=[
            FrameTransform(parent_frame_id="map", child_frame_id="odom", translation=Vector3(x=10), rotation=turned),
            FrameTransform(
                parent_frame_id="odom",
                child_frame_id="base_link",
                translation=Vector3(x=1),
                rotation=Quaternion(w=1),
            ),
        ]
    )


def cloud(points: list[tuple[float, float, float]], frame: str = "base_link") -> PointCloud:
    data = np.array(points, dtype="<f4")
    fields = [PackedElementField(name=n, offset=4 * i, type=PackedElementField.FLOAT32) for i, n in enumerate("xyz")]
    return PointCloud(frame_id=frame, point_stride=12, fields=fields, data=data.tobytes())


def grid(values: list[list[float]]) -> Grid:
    data = np.array(values, dtype="<f4")
    return Grid(
        frame_id="odom",
        column_count=data.shape[1],
        cell_size=Vector2(x=0.5, y=0.5),
        row_stride=4 * data.shape[1],
        cell_stride=4,
        fields=[PackedElementField(name="obstacle_distance", offset=0, type=PackedElementField.FLOAT32)],
        data=data.tobytes(),
    )


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sensing") / "session.mcap"
    with path.open("wb") as stream, Writer(stream) as writer:
        for second in range(4):
            at = second * SECOND
            writer.write_message("/tf", transforms(), log_time=at)
            writer.write_message(
                "/camera/front",
                CompressedImage(frame_id="base_link", data=jpeg(60 * second), format="jpeg"),
                log_time=at,
            )
            writer.write_message("/lidar", cloud([(1 + second, 0, 0.5), (1, 0, 0.5)]), log_time=at)
        lens = CameraCalibration(width=64, height=48, K=[40, 0, 32, 0, 40, 24, 0, 0, 1])
        writer.write_message("/camera/front/calibration", lens, log_time=0)
        writer.write_message("/robot/local_grid", grid([[-0.1, 0.2, 1.0]]), log_time=SECOND)
        writer.write_message("/map", grid([[-0.1]]), log_time=0)
    return path


@pytest.fixture(scope="module")
def robot_sensors(log: Path) -> RobotSensors:
    found = sensors_of(log)
    assert found is not None
    return found


def frames_of(log: Path) -> Frames:
    return Frames(sensor_tracks(log))


def test_tracks_are_found_by_index_and_by_walking_alike(log: Path, tmp_path: Path) -> None:
    whole = sensor_tracks(log)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:-200])
    walked = sensor_tracks(cut)
    assert set(whole.tracks) == set(walked.tracks)
    for topic, track in whole.tracks.items():
        assert track.stamps_ns.tolist() == walked.tracks[topic].stamps_ns.tolist()
        message = whole.message(track, 0)
        assert message is not None
        assert message.SerializeToString() == walked.message(walked.tracks[topic], 0).SerializeToString()


def test_frames_are_chained_to_the_map(log: Path) -> None:
    pose = frames_of(log).on_map("base_link", 2 * SECOND)
    assert pose is not None
    assert pose[:3, 3] == pytest.approx([10.0, 1.0, 0.0])
    assert pose[:3, 0] == pytest.approx([0.0, 1.0, 0.0]), "its x axis looks along the map's y"
    assert frames_of(log).on_map("somewhere else", 2 * SECOND) is None


def test_the_site_grows_with_time_and_keeps_each_place_once(robot_sensors: RobotSensors) -> None:
    assert len(robot_sensors.site(9 * SECOND)) == 0, "not gathered yet"
    robot_sensors.gather_site()
    assert robot_sensors.site(0).tolist() == pytest.approx(np.array([[10, 2, 0.5]]))
    assert [len(robot_sensors.site(s * SECOND)) for s in (-1, 0, 1, 2, 3, 9)] == [0, 1, 2, 3, 4, 4]


def test_pictures_are_the_newest_at_a_moment_with_lens_and_place(robot_sensors: RobotSensors) -> None:
    assert robot_sensors.pictures(-1) == ()
    (first,), (third,) = robot_sensors.pictures(0), robot_sensors.pictures(2 * SECOND + 5)
    assert (first.stamp_ns, third.stamp_ns) == (0, 2 * SECOND)
    assert third.data == jpeg(120)
    assert third.aspect == pytest.approx(64 / 48)
    assert third.field_rad == pytest.approx(2 * np.arctan(24 / 40))
    assert third.on_map is not None
    assert third.on_map[:3, 3] == pytest.approx([10.0, 1.0, 0.0])
    shown = pixels(third)
    assert shown is not None
    assert shown.shape == (48, 64, 3)


def test_a_grey_picture_of_16_bits_is_not_cut_off_at_255() -> None:
    stream = io.BytesIO()
    Image.fromarray(np.array([[0, 256, 0x8000, 0xFFFF]], dtype=np.uint16)).save(stream, "PNG")
    picture = Picture(
        topic="/camera", stamp_ns=0, mime="image/png", data=stream.getvalue(), on_map=None, field_rad=1.0, aspect=4.0
    )
    shown = pixels(picture)
    assert shown is not None
    assert shown[0].tolist() == [[0] * 3, [1] * 3, [128] * 3, [255] * 3]


def test_the_panel_shows_pictures_and_their_age(robot_sensors: RobotSensors) -> None:
    made = cameras(robot_sensors.pictures(60 * SECOND), 60 * SECOND)
    assert "data:image/jpeg;base64," in made
    assert "57 s old" in made
    assert "No picture yet" in cameras((), 0)


def test_blocked_and_near_cells_lie_where_the_grid_says(robot_sensors: RobotSensors) -> None:
    cells = robot_sensors.grid(2 * SECOND)
    assert cells is not None
    assert cells.blocked.tolist() == [True, False], "the far cell is free and not drawn"
    assert cells.vertices[:4, :2] == pytest.approx(np.array([[10, 0], [10, 0.5], [9.5, 0.5], [9.5, 0]]))
    assert cells.faces_of(cells.blocked).tolist() == [[0, 1, 2], [0, 2, 3]]
    assert robot_sensors.grid(0) is None, "there was none yet"
    assert robot_sensors.grid(60 * SECOND) is None, "the robot has walked on"


@pytest.mark.parametrize("lie", ["stride", "offset", "type", "bytes", "frame", "rotation"])
def test_clouds_that_lie_give_no_points(log: Path, lie: str) -> None:
    made = cloud([(1, 2, 3)])
    if lie == "stride":
        made.point_stride = 0
    elif lie == "offset":
        made.fields[2].offset = 4_000_000_000
    elif lie == "type":
        made.fields[0].type = 0
    elif lie == "bytes":
        made.data = b"123"
    elif lie == "frame":
        made.frame_id = "nowhere"
    else:
        made.pose.orientation.w = 7.0
    assert len(cloud_points(made, frames_of(log), SECOND)) == len(NOTHING)


@pytest.mark.parametrize("lie", ["columns", "row", "cell", "huge", "field"])
def test_grids_that_lie_give_no_cells(log: Path, lie: str) -> None:
    made = grid([[-0.1, 0.2]])
    if lie == "columns":
        made.column_count = 4_000_000_000
    elif lie == "row":
        made.row_stride = 0
    elif lie == "cell":
        made.cell_stride = 0
    elif lie == "huge":
        made.column_count, made.row_stride, made.cell_stride = 1 << 20, 4 << 20, 4
        made.data = bytes(4 << 20)
    else:
        del made.fields[:]
    assert grid_cells(made, frames_of(log), SECOND) is None


def test_pictures_are_told_by_their_bytes() -> None:
    assert mime_of(jpeg()) == "image/jpeg"
    assert mime_of(b"<svg onload=alert(1)>") is None
    assert mime_of(b"") is None


def test_not_a_number_is_not_drawn(log: Path) -> None:
    points = cloud_points(cloud([(float("nan"), 0, 0), (float("inf"), 0, 0), (1, 0, 0)]), frames_of(log), SECOND)
    assert points.tolist() == pytest.approx(np.array([[10, 2, 0]]))
    assert matrix(Vector3(x=float("nan")), Quaternion(w=1)) is None


def test_the_sample_log_of_a_spot_has_pictures_where_its_camera_stood() -> None:
    robot_sensors = sensors_of(SPOT)
    assert robot_sensors is not None
    assert robot_sensors.cameras == ("/camera/frontleft_fisheye",)
    assert robot_sensors.has_grids
    tracks = sensor_tracks(SPOT)
    at = int(tracks.tracks["/camera/frontleft_fisheye"].stamps_ns[2])
    (picture,) = robot_sensors.pictures(at)
    assert picture.on_map is not None, "told by the robot's own frames"
    assert mime_of(picture.data) == "image/jpeg"
    grids = tracks.tracks["/robot/local_grid"].stamps_ns
    assert robot_sensors.grid(int(grids[0])) is not None


def test_a_simulated_run_has_no_sensors() -> None:
    assert sensors_of(LOGS / "find-lios.mcap") is None


def test_a_missing_log_is_said(tmp_path: Path) -> None:
    with pytest.raises(NotFound):
        sensors_of(tmp_path / "none.mcap")


def test_a_spot_depth_camera_shows_the_walls_that_it_was_drawn_from() -> None:
    """Points of the simulated depth camera lie on occupied cells of the site's map, to a cell's width."""
    bosdyn = pytest.importorskip("bosdyn.api")
    del bosdyn
    from bosdyn.api import image_pb2

    from dashboards.sensing.clouds import depth_points
    from recorders.spot.simulated.camera import depth_picture
    from recorders.spot.simulated.frames import optical, se3
    from recorders.spot.simulated.services.images import _depth_source
    from workbench.worlds.geometry import Pose
    from workbench.worlds.sites.site import load_site

    site = load_site("paper_home")
    grid_ = site.grid
    assert grid_ is not None
    pose = Pose(x_m=10.0, y_m=2.4, yaw_rad=pi)
    depth = depth_picture(grid_, pose, 0.0)
    answer = image_pb2.ImageResponse(source=_depth_source())
    answer.shot.frame_name_image_sensor = "depth"
    answer.shot.image.CopyFrom(
        image_pb2.Image(rows=depth.shape[0], cols=depth.shape[1], data=depth.tobytes(), format=2, pixel_format=5)
    )
    for child, parent, placed in (
        ("odom", "body", se3(0, 0, -0.5, 0)),
        ("depth", "body", optical(0, 0, 0, 0)),
    ):
        edge = answer.shot.transforms_snapshot.child_to_parent_edge_map[child]
        edge.parent_frame_name = parent
        edge.parent_tform_child.CopyFrom(placed)

    class Here(Frames):
        def __init__(self) -> None:
            pass

        def on_map(self, frame: str, stamp_ns: int) -> np.ndarray:
            assert frame == "odom"
            c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
            return np.array([[c, -s, 0, pose.x_m], [s, c, 0, pose.y_m], [0, 0, 1, 0], [0, 0, 0, 1]])

    points = depth_points(answer, Here(), 0)
    walls = points[(points[:, 2] > 0.1) & (points[:, 2] < 1.2)]
    assert len(walls) > 500
    cells = np.argwhere(grid_.occupied) * grid_.resolution_m + np.array(grid_.origin)[::-1] + grid_.resolution_m / 2
    some = walls[:: len(walls) // 100]
    away = np.sqrt(((some[:, None, 1::-1] - cells[None]) ** 2).sum(axis=2)).min(axis=1)
    assert np.quantile(away, 0.9) < 0.15
    answer.shot.image.rows = 7
    assert len(depth_points(answer, Here(), 0)) == 0, "rows that do not fit the bytes"


@pytest.mark.parametrize("resized", [1, 2])
def test_depth_pixels_are_placed_as_the_sdk_places_them(resized: int) -> None:
    """Against bosdyn.client.image on a picture at full size; a resized one has its points on the same rays.

    0 is nothing measured and 65535 is out of range; both are left out.
    """
    pytest.importorskip("bosdyn.client")
    from bosdyn.api import image_pb2
    from bosdyn.client.image import depth_image_to_pointcloud

    from dashboards.sensing.clouds import depth_points

    answer = image_pb2.ImageResponse()
    source, shot = answer.source, answer.shot
    source.cols, source.rows, source.depth_scale, source.image_type = 4 * resized, 3 * resized, 1000, 2
    lens = source.pinhole.intrinsics
    lens.focal_length.x = lens.focal_length.y = 2.0 * resized
    lens.principal_point.x, lens.principal_point.y = 2.0 * resized - 0.5, 1.5 * resized - 0.5
    depths = np.array([[0, 65535, 1000, 65534], [500, 1, 2000, 0], [1500, 3000, 65535, 700]], dtype="<u2")
    shot.image.CopyFrom(image_pb2.Image(rows=3, cols=4, data=depths.tobytes(), format=2, pixel_format=5))
    shot.frame_name_image_sensor = "odom"
    shot.transforms_snapshot.child_to_parent_edge_map["odom"].parent_frame_name = ""

    class Still(Frames):
        def __init__(self) -> None:
            pass

        def on_map(self, frame: str, stamp_ns: int) -> np.ndarray:
            return np.eye(4)

    points = depth_points(answer, Still(), 0)
    source.cols, source.rows = 4, 3
    lens.focal_length.x = lens.focal_length.y = 2.0
    lens.principal_point.x, lens.principal_point.y = 1.5, 1.0
    np.testing.assert_allclose(points, depth_image_to_pointcloud(answer), rtol=1e-5)
    assert len(points) == 8


def test_a_growing_log_is_not_searched_for_sensors_at_every_look(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dashboards.library.library import Library

    now = [100.0]
    monkeypatch.setattr("dashboards.library.library.time.monotonic", lambda: now[0])
    library = Library([SPOT])
    first = library.robot_sensors(0)
    library.reread(0)
    assert library.robot_sensors(0) is first
    now[0] += 3.0
    library.reread(0)
    assert library.robot_sensors(0) is not first
