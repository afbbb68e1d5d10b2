"""The parts of the simulated robot and of a session, one by one."""

from __future__ import annotations

import ssl
from math import pi
from pathlib import Path

import numpy as np
import pytest
from bosdyn.api import estop_pb2, geometry_pb2, image_pb2, lease_pb2, local_grid_pb2, world_object_pb2
from bosdyn.client.frame_helpers import get_a_tform_b
from bosdyn.client.lease import Lease
from bosdyn.client.math_helpers import SE3Pose
from spot_help import robot

from recorders.certificate import Identity, new_identity
from recorders.spot.client.connection import Credentials, RobotAddress, find_credentials
from recorders.spot.client.odometer import WalkLog
from recorders.spot.client.time_source import SteppedClock
from recorders.spot.run.operator import KeyboardOperator, StopSwitch
from recorders.spot.session import foxglove
from recorders.spot.simulated.body import Body, BodyWalk, Motors, WalkState, wrapped
from recorders.spot.simulated.estop import EstopBoard
from recorders.spot.simulated.faults import FaultKind, read_faults
from recorders.spot.simulated.frames import frame_tree, kinematics, pose_in_map, se3
from recorders.spot.simulated.leases import LeaseBook
from recorders.spot.simulated.robot import UntaggedItem, new_state
from recorders.spot.simulated.sight import sees, thing_in
from recorders.spot.tags.detections import place_on_map, robot_detections
from recorders.spot.tags.item_places import within
from workbench.errors import BadValue
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, House, Item, ItemId, ItemType, LocationId
from workbench.worlds.sites.site import Site, load_site


@pytest.fixture(scope="module")
def home() -> Site:
    return load_site("paper_home")


def walking(corners: list[tuple[float, float]], *, yaw: float | None = None, speed: float = 0.5) -> Body:
    body = Body(pose=Pose(x_m=0.0, y_m=0.0), speed_mps=speed, motors=Motors.ON, standing=True, posture_at_s=-10.0)
    body.go(BodyWalk(number=1, corners=corners, final_yaw_rad=yaw, speed_mps=speed, end_s=1000.0))
    return body


def test_a_straight_walk_takes_its_length_over_the_speed() -> None:
    body = walking([(2.0, 0.0)])
    body.advance_to(3.9)
    assert body.walk is not None
    assert body.walk.state is WalkState.WALKING
    body.advance_to(4.1)
    assert body.walk.state is WalkState.ARRIVED
    assert (body.pose.x_m, body.pose.y_m) == pytest.approx((2.0, 0.0))
    assert body.walked_m == pytest.approx(2.0)


def test_a_sharp_corner_is_turned_on_the_spot_and_the_end_faced() -> None:
    body = walking([(1.0, 0.0), (1.0, 1.0)], yaw=pi)
    body.advance_to(4.0)
    assert body.walk is not None
    assert body.walk.state is WalkState.WALKING
    body.advance_to(12.0)
    assert body.walk.state is WalkState.ARRIVED
    assert body.pose.yaw_rad == pytest.approx(pi, abs=1e-3) or body.pose.yaw_rad == pytest.approx(-pi, abs=1e-3)


def test_odometry_drifts_from_the_map_a_little() -> None:
    body = walking([(10.0, 0.0)])
    body.advance_to(30.0)
    assert 0.01 < body.odom.x_m - 10.0 < 0.1
    assert abs(body.vision.x_m - 10.0) < abs(body.odom.x_m - 10.0)


def test_velocities_are_in_their_frames() -> None:
    """As robot_state.proto says: expressed in odom and vision, and the body's own, wherever it is."""
    body = walking([(0.0, 3.0)], yaw=pi)
    body.advance_to(4.0)
    state = kinematics(body, 0)
    for velocity in (state.velocity_of_body_in_odom, state.velocity_of_body_in_vision):
        assert (velocity.linear.x, velocity.linear.y, velocity.angular.z) == pytest.approx((0.0, 0.5, 0.0), abs=0.02)
    body.advance_to(7.5)
    turning = kinematics(body, 0).velocity_of_body_in_odom
    assert (turning.linear.x, turning.linear.y, turning.angular.z) == pytest.approx((0.0, 0.0, 1.2), abs=0.02)
    body.advance_to(20.0)
    assert kinematics(body, 0).velocity_of_body_in_odom.angular.z == 0.0


def test_the_tree_of_frames_takes_poses_there_and_back() -> None:
    body = walking([(3.0, 0.0), (3.0, 2.0)], yaw=0.3)
    body.advance_to(30.0)
    tree = frame_tree(body)
    for frame in ("odom", "vision"):
        at = get_a_tform_b(tree, frame, "body")
        assert at is not None
        back = pose_in_map(body, frame, at.x, at.y, at.rot.to_yaw())
        assert back is not None
        assert (back.x_m, back.y_m) == pytest.approx((body.pose.x_m, body.pose.y_m))
        assert wrapped(back.yaw_rad - body.pose.yaw_rad) == pytest.approx(0.0, abs=1e-9)


def test_viewers_get_the_robot_where_localisation_puts_it() -> None:
    body = walking([(3.0, 0.0), (3.0, 2.0)], yaw=0.3)
    body.advance_to(30.0)
    on_map = se3(body.pose.x_m, body.pose.y_m, 0.52, body.pose.yaw_rad)
    link = foxglove.map_from_odom(on_map, frame_tree(body))
    tree = foxglove.transforms(frame_tree(body), link, 5)
    assert [(t.parent_frame_id, t.child_frame_id) for t in tree.transforms] == [
        ("map", "odom"),
        ("odom", "base_link"),
        ("odom", "vision"),
    ]
    total = SE3Pose.from_identity()
    for part in tree.transforms[:2]:
        q, p = part.rotation, part.translation
        total = total * SE3Pose.from_proto(
            geometry_pb2.SE3Pose(
                position=geometry_pb2.Vec3(x=p.x, y=p.y, z=p.z),
                rotation=geometry_pb2.Quaternion(x=q.x, y=q.y, z=q.z, w=q.w),
            )
        )
    assert (total.x, total.y, total.z) == pytest.approx((body.pose.x_m, body.pose.y_m, 0.52))
    assert total.rot.to_yaw() == pytest.approx(body.pose.yaw_rad)


def test_faults_are_read_as_they_are_written() -> None:
    faults = read_faults(["stuck@30+10", "dropped@5+3", "clock-skew@0+-2.5", "estop"])
    assert [(f.kind, f.at_s, f.for_s) for f in faults] == [
        (FaultKind.CLOCK_SKEW, 0.0, -2.5),
        (FaultKind.ESTOP, 0.0, None),
        (FaultKind.DROPPED, 5.0, 3.0),
        (FaultKind.STUCK, 30.0, 10.0),
    ]
    for wrong in ("stuck@soon", "tired@3", "", "stuck@3+"):
        with pytest.raises(BadValue, match="lost-lease"):
            read_faults([wrong])


def test_leases_only_grow() -> None:
    book, status = LeaseBook(), lease_pb2.LeaseUseResult
    first = book.grant("me")
    assert book.use(first).status == status.STATUS_OK
    assert book.use(Lease(first).create_sublease().lease_proto).status == status.STATUS_OK
    second = book.grant("you")
    assert book.use(first).status == status.STATUS_OLDER
    assert book.use(second).status == status.STATUS_OK
    strange = lease_pb2.Lease(resource="body", epoch="other", sequence=[9])
    assert book.use(strange).status == status.STATUS_WRONG_EPOCH
    assert book.use(lease_pb2.Lease()).status == status.STATUS_INVALID_LEASE
    assert not book.give_back(first)
    assert book.give_back(second)
    assert book.is_free
    assert book.use(second).status == status.STATUS_REVOKED


def test_the_emergency_stop_needs_an_endpoint_that_answers() -> None:
    assert not EstopBoard().stopped, "without endpoints nothing stops it"
    board, check = EstopBoard(open_without_endpoints=False), estop_pb2.EstopCheckInResponse
    assert board.stopped
    endpoint = board.register(estop_pb2.EstopEndpoint(name="x"))
    endpoint.timeout.seconds = 5

    def check_in(challenge: int, response: int, level: int) -> tuple[int, int]:
        return board.check_in(
            estop_pb2.EstopCheckInRequest(
                endpoint=endpoint,
                challenge=challenge,
                response=response,
                stop_level=level,  # type: ignore[arg-type]
            )
        )

    status, challenge = check_in(0, 0, estop_pb2.ESTOP_LEVEL_NONE)
    assert status == check.STATUS_INCORRECT_CHALLENGE_RESPONSE
    assert board.stopped
    board.endpoints[endpoint.unique_id].proto.timeout.seconds = 5
    status, _ = check_in(challenge, ~challenge & 0xFFFFFFFFFFFFFFFF, estop_pb2.ESTOP_LEVEL_NONE)
    assert status == check.STATUS_OK
    assert not board.stopped
    board.press()
    assert board.stopped


def test_tags_are_seen_in_range_and_line_of_sight_only(home: Site) -> None:
    phone = thing_in(102, home.plan.container(ContainerId("dining_table")), 0)
    near, behind_a_wall, far = Pose(x_m=1.5, y_m=1.8), Pose(x_m=1.5, y_m=-0.5), Pose(x_m=4.8, y_m=2.4)
    assert sees(home, near, phone)
    assert not sees(home, behind_a_wall, phone)
    assert not sees(home, far, phone)
    bottle = thing_in(101, home.plan.container(ContainerId("fridge")), 0)
    stand = home.paths.standing_pose(LocationId("fridge"))
    assert stand is not None
    assert sees(home, stand, bottle)
    assert not sees(home, Pose(x_m=stand.x_m - 1.0, y_m=stand.y_m), bottle), "a closed fridge shows nothing"


def test_a_tag_belongs_to_the_container_that_it_stands_on(home: Site) -> None:
    table = home.plan.container(ContainerId("dining_table"))
    assert within(table, (1.5, 1.0, 0.75), margin_m=0.1)
    assert within(table, (2.25, 1.0, 0.75), margin_m=0.1)
    assert not within(table, (2.35, 1.0, 0.75), margin_m=0.1)
    assert not within(table, (1.5, 1.0, 2.0), margin_m=0.1)


def test_an_item_without_a_tag_is_refused(home: Site) -> None:
    house = House(plan=home.plan, contents={ContainerId("bed"): (Item(id=ItemId("Egg|1"), type=ItemType("Egg")),)})
    with pytest.raises(UntaggedItem, match=r"Egg\|1"):
        new_state(home, house, SteppedClock())


def test_every_identity_differs_and_holds_for_its_names_alone(tmp_path: Path) -> None:
    one, two = new_identity(["a.spot.robot"]), new_identity(["a.spot.robot"])
    assert one.key_pem != two.key_pem
    assert _greeting(one, trusts=one, asks_for="a.spot.robot", folder=tmp_path) == "a.spot.robot"
    for trusts, asks_for in ((two, "a.spot.robot"), (one, "b.spot.robot")):
        with pytest.raises(ssl.SSLCertVerificationError):
            _greeting(one, trusts=trusts, asks_for=asks_for, folder=tmp_path)


def _greeting(shown: Identity, *, trusts: Identity, asks_for: str, folder: Path) -> str:
    """For which name a client that trusts one root takes what a server shows; a TLS handshake in memory."""
    (folder / "server.pem").write_bytes(shown.key_pem + shown.chain_pem)
    server_side = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    server_side.load_cert_chain(folder / "server.pem")
    client_side = ssl.create_default_context(cadata=trusts.root_pem.decode("ascii"))
    up, down = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = client_side.wrap_bio(down, up, server_hostname=asks_for)
    server = server_side.wrap_bio(up, down, server_side=True)
    waiting: list[ssl.SSLObject] = [client, server]
    while waiting:
        side = waiting.pop(0)
        try:
            side.do_handshake()
        except ssl.SSLWantReadError:
            waiting.append(side)
    (_, name), *_ = client.getpeercert()["subjectAltName"]
    return name


def test_local_grids_are_unpacked_or_refused() -> None:
    grid = local_grid_pb2.LocalGrid(
        cell_format=local_grid_pb2.LocalGrid.CELL_FORMAT_INT16,
        encoding=local_grid_pb2.LocalGrid.ENCODING_RLE,
        data=np.array([5, 10], dtype="<i2").tobytes(),
        rle_counts=[4, 2],
        cell_value_scale=0.1,
    )
    grid.extent.num_cells_x, grid.extent.num_cells_y = 3, 2
    assert foxglove.grid_values(grid).ravel().tolist() == pytest.approx([0.5, 0.5, 0.5, 0.5, 1.0, 1.0])
    assert foxglove.grid_values(grid).shape == (2, 3)
    for counts in ([4, 3], [4], [-1, 7], [10**9, 10**9]):
        del grid.rle_counts[:]
        grid.rle_counts.extend(counts)
        assert foxglove.grid_values(grid) is None


def test_cells_that_a_robot_does_not_know_are_not_free() -> None:
    """By a byte a cell, or a byte a run, or a bit a cell in either order; by what fits none of them, all."""
    grid = local_grid_pb2.LocalGrid(
        cell_format=local_grid_pb2.LocalGrid.CELL_FORMAT_INT16,
        encoding=local_grid_pb2.LocalGrid.ENCODING_RLE,
        data=np.array([5, 10], dtype="<i2").tobytes(),
        rle_counts=[4, 2],
        unknown_cells=bytes([1, 0, 0, 0, 0, 1]),
    )
    grid.extent.num_cells_x, grid.extent.num_cells_y = 3, 2
    assert np.argwhere(np.isnan(foxglove.grid_values(grid))).tolist() == [[0, 0], [1, 2]]
    grid.unknown_cells = bytes([0, 1])
    assert np.isnan(foxglove.grid_values(grid)).ravel().tolist() == [False] * 4 + [True] * 2
    grid.unknown_cells = bytes([0b00000100])
    assert np.isnan(foxglove.grid_values(grid)).ravel().tolist() == [False, False, True, False, False, True]
    grid.unknown_cells = bytes(5)
    assert np.isnan(foxglove.grid_values(grid)).all()
    grid.unknown_cells = b""
    assert np.isfinite(foxglove.grid_values(grid)).all()


def test_a_lens_is_scaled_about_the_edge_of_the_picture_and_not_the_centre_of_its_first_pixel() -> None:
    """Of 640 by 480 halved: an axis through the middle, index 319.5, is through the middle of the half, 159.5."""
    source = image_pb2.ImageSource(cols=640, rows=480)
    lens = source.pinhole.intrinsics
    lens.focal_length.x, lens.focal_length.y = 300, 310
    lens.principal_point.x, lens.principal_point.y = 319.5, 239.5
    shot = image_pb2.ImageCapture(image=image_pb2.Image(cols=320, rows=120))
    scaled = foxglove.calibration(source, shot, 0)
    assert list(scaled.K) == [150, 0, 159.5, 0, 310 / 4, 59.5, 0, 0, 1]


def test_a_16_bit_picture_is_kept_as_it_came() -> None:
    """Spot's grey pixels of 16 bits are big-endian, its depths little-endian: neither is turned into a picture."""
    for kind in (image_pb2.Image.PIXEL_FORMAT_GREYSCALE_U16, image_pb2.Image.PIXEL_FORMAT_DEPTH_U16):
        image = image_pb2.Image(
            cols=1, rows=1, data=b"\x01\x02", format=image_pb2.Image.FORMAT_RAW, pixel_format=kind
        )
        assert foxglove.picture(image_pb2.ImageCapture(image=image), 0) is None


def test_a_walk_is_thinned_to_its_corners() -> None:
    walked = WalkLog()
    for i in range(21):
        walked.add((i * 0.1, 0.0))
        walked.add((i * 0.1, 0.001))
    for i in range(1, 11):
        walked.add((2.0, i * 0.1))
    assert walked.metres == pytest.approx(3.0, abs=0.01)
    assert [(round(x, 3), round(y, 3)) for x, y in walked.corners()] == [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0)]


def test_addresses_and_credentials(monkeypatch: pytest.MonkeyPatch) -> None:
    assert RobotAddress.read("192.168.80.3") == RobotAddress(host="192.168.80.3", port=443)
    assert RobotAddress.read("localhost:50443").port == 50443
    for wrong in ("host:", ":443", "host:port", "host:99999", ""):
        with pytest.raises(BadValue, match="HOST"):
            RobotAddress.read(wrong)
    assert "secret" not in repr(Credentials(username="me", password="secret"))
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "me")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "secret")
    assert find_credentials().password == "secret"
    monkeypatch.delenv("BOSDYN_CLIENT_PASSWORD")
    with pytest.raises(BadValue, match="BOSDYN_CLIENT_PASSWORD"):
        find_credentials()


def test_keys_stop_confirm_and_note() -> None:
    stop, heard = StopSwitch(), []
    keys = KeyboardOperator(stop, heard.append)
    assert not keys.confirm("Anybody there?"), "without a terminal nobody answers"
    keys.press("n")
    assert heard == ["n"]
    keys.press(" ")
    assert stop.is_pressed
    assert stop.reason == "stopped by key"


@pytest.mark.parametrize(
    ("status", "reliable"), [("STATUS_OK", True), ("STATUS_AMBIGUOUS", False), ("STATUS_HIGH_ERROR", False)]
)
def test_tags_are_read_from_raw_frames_with_the_status_of_their_pose(status: str, reliable: bool) -> None:
    with robot() as (spot, connection):
        found = world_object_pb2.WorldObject()
        mark = found.apriltag_properties
        mark.tag_id, mark.frame_name_fiducial, mark.frame_name_fiducial_filtered = 7, "raw", "filtered"
        mark.fiducial_pose_status = world_object_pb2.AprilTagProperties.AprilTagPoseStatus.Value(status)
        frames = {"raw": ("body", se3(1.0, 0.0, 0.0, 0.0)), "filtered": ("body", se3(2.0, 0.0, 0.0, 0.0))}
        found.transforms_snapshot.CopyFrom(frame_tree(spot.state.body, frames))
        (sighting,) = place_on_map(
            robot_detections([found], connection.clock, {}), SE3Pose.from_proto(se3(0.0, 0.0, 0.0, 0.0))
        )
    assert sighting.position[0] == pytest.approx(1.0)
    assert sighting.reliable is reliable
