"""Failures of the first hour with a real robot: each gives one line, frees the lease, and invents no data."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import msgspec
import pytest
from bosdyn.api import geometry_pb2, power_pb2, synchronized_command_pb2
from bosdyn.api.graph_nav import nav_pb2
from spot_help import is_free, messages, placed, robot, run_of

from recorders.spot.client.connection import Connection, Credentials, RobotAddress
from recorders.spot.client.control import Control
from recorders.spot.client.errors import NotLocalized, NotReady
from recorders.spot.client.frame_trees import tform
from recorders.spot.client.localization import is_localized
from recorders.spot.client.time_source import RunningClock
from recorders.spot.record_session import SessionPlan, record_session
from recorders.spot.run.arm_motion import ArmOutcome, command_result, place_on
from recorders.spot.run.navigate import navigation_goal, renew_navigation, speed_limit
from recorders.spot.run.operator import StopSwitch, stop_on_signals
from recorders.spot.run.run import first_decision, run_and_record
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.session.sensor_pollers import check_cameras
from recorders.spot.session.session import Rates
from recorders.spot.session.topics import Gap
from recorders.spot.simulated.faults import FaultKind
from recorders.spot.simulated.services.local_grids import LocalGrids
from replayers.runs.run import read
from workbench.errors import MalformedFile, UnknownName
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.sites.site import load_site
from workbench.worlds.world import ActionDone, ActionRefused

QUICK = Rates(state_hz=20.0, localization_hz=5.0, fiducials_hz=0.0, images_hz=5.0, grid_hz=5.0, image_ratio=0.25)


@pytest.mark.parametrize(
    ("refusal", "said"),
    [
        (power_pb2.STATUS_SHORE_POWER_CONNECTED, "unplug"),
        (power_pb2.STATUS_KEEPALIVE_MOTORS_OFF, "keepalive"),
        (power_pb2.STATUS_FAULTED, "fault"),
    ],
)
def test_motors_that_do_not_come_on_are_told_in_words(refusal: int, said: str, tmp_path: Path) -> None:
    with robot() as (spot, connection):
        spot.state.power_refusal = refusal
        with pytest.raises(NotReady, match=said) as caught:
            run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert "\n" not in str(caught.value)
        assert spot.state.leases.owner is None


def test_a_run_that_does_not_begin_leaves_no_log(tmp_path: Path) -> None:
    from recorders.spot.client.errors import LeaseTaken

    with robot() as (spot, connection):
        spot.inject(FaultKind.LOST_LEASE)
        with pytest.raises(LeaseTaken, match="--take-lease"):
            run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
    assert not list(tmp_path.glob("*.mcap")), "the next attempt needs no --force"


def test_a_certificate_that_is_none_is_said(tmp_path: Path) -> None:
    (tmp_path / "x.pem").write_text("nothing of the kind")
    login = Credentials(username="user", password="simulated")
    with pytest.raises(MalformedFile, match="no certificate"):
        Connection(RobotAddress(host="127.0.0.1", port=9), login, certificate=tmp_path / "x.pem")


def test_a_behaviour_fault_is_named(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        spot.state.behaviour_fault = True
        with pytest.raises(NotReady, match="clear it on the tablet"):
            run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert spot.state.leases.owner is None


def test_a_robot_that_sees_no_fiducial_from_the_floor_stands_up_first(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        spot.state.fiducials_from_floor = False
        with pytest.raises(NotLocalized, match="fiducial"):
            first_decision(connection, run_of(spot))
        report = run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert report.ended.status == "done", report.ended.reason
        assert report.lease_returned
        assert spot.state.leases.owner is None


def test_a_robot_that_no_longer_hears_us_stops_and_goes_on_when_it_does() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        world = SpotWorld(
            connection=connection, control=control, site=placed()[0], settings=RunSettings(poll_s=0.5, resume=True)
        )
        bed = LocationId("bed")
        standing = world.site.paths.standing_pose(bed)
        assert standing is not None
        number = renew_navigation(world, navigation_goal(world, bed, standing), None)
        connection.clock.sleep(0.7)
        with spot.state.alive() as state:
            assert state.body.walk is not None
            assert state.body.walk.state == "walking"
        connection.clock.sleep(2.0)
        with spot.state.alive() as state:
            assert state.body.walk.state == "expired", "a second of silence and it stands"
            assert 0.2 < state.body.walked_m <= 0.5
        again = renew_navigation(world, navigation_goal(world, bed, standing), number)
        assert again != number, "a new command, the old is forgotten"
        assert isinstance(world.go_to(bed), ActionDone)


def test_a_speed_limit_holds_backwards_too() -> None:
    limit = speed_limit(0.4)
    assert (limit.max_vel.linear.x, limit.min_vel.linear.x) == (0.4, -0.4)
    assert limit.min_vel.angular < 0


def test_the_sites_speed_is_sent_with_every_command_to_waypoints_and_poses() -> None:
    """The robot does not know the site's speed: without a limit it walks at its own, 1.6 m/s."""
    sent: list[float] = []

    def take(*_: Any, travel_params: Any, **__: Any) -> int:
        sent.append(travel_params.velocity_limit.max_vel.linear.x)
        return 1

    with robot() as (spot, connection):
        assert spot.state.body.speed_mps > spot.state.site.robot.speed_mps
        client = connection.client("graph-nav-service")
        client.set_localization(nav_pb2.Localization(), fiducial_init=2)
        client.navigate_to = client.navigate_to_anchor = take
        for site in (placed()[0], replace(placed()[0], waypoints={})):
            world = SpotWorld(connection=connection, control=Control(connection), site=site)
            navigation_goal(world, LocationId("bed"), Pose(x_m=1.0, y_m=2.0))(None)
        world.settings = RunSettings(speed_mps=0.3)
        navigation_goal(world, LocationId("bed"), Pose(x_m=1.0, y_m=2.0))(None)
    assert sent == pytest.approx([0.5, 0.5, 0.3])


def test_a_robot_that_says_that_it_is_localised_is_localised_anew_before_it_moves() -> None:
    asked: list[int] = []
    with robot() as (_spot, connection):
        client = connection.client("graph-nav-service")
        client.set_localization(nav_pb2.Localization(), fiducial_init=2)
        real = client.set_localization
        client.set_localization = lambda *a, **k: asked.append(k["fiducial_init"]) or real(*a, **k)
        world = SpotWorld(connection=connection, control=Control(connection), site=placed()[0])
        assert world.localize()
    assert asked == [2], "by the nearest fiducial"


def test_poses_of_the_map_are_sent_at_the_height_of_the_body() -> None:
    """GraphNav chooses the floor by z (Spot SDK, graph_nav_command_line: without a z it takes the body's own)."""
    sent: list[geometry_pb2.SE3Pose] = []
    with robot() as (_spot, connection):
        client = connection.client("graph-nav-service")
        client.set_localization(nav_pb2.Localization(), fiducial_init=2)
        site = replace(placed()[0], waypoints={})
        world = SpotWorld(connection=connection, control=Control(connection), site=site)
        client.navigate_to_anchor = lambda goal, *_, **__: sent.append(goal) or 1
        navigation_goal(world, LocationId("bed"), Pose(x_m=1.0, y_m=2.0))(None)
    assert sent[0].position.z == pytest.approx(0.22), "it lies"


def test_a_lost_robot_is_not_localized_though_it_keeps_its_waypoint(tmp_path: Path) -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        client = connection.client("graph-nav-service")
        client.set_localization(nav_pb2.Localization(), fiducial_init=2)
        assert is_localized(client.get_localization_state())
        spot.inject(FaultKind.LOST_LOCALIZATION)
        state = client.get_localization_state()
        assert state.localization.waypoint_id
        assert not is_localized(state)
        world = SpotWorld(connection=connection, control=control, site=placed()[0])
        assert world.localize(), "by a fiducial"
        spot.inject(FaultKind.LOST_LOCALIZATION)
        connection.client("graph-nav-service").set_localization = _fails
        looked = world.look_into(ContainerId("bed"))
        assert isinstance(looked, ActionRefused), "a look that cannot be placed says nothing of what is there"
        assert "does not know where it is" in looked.reason


def _fails(*_: object, **__: object) -> None:
    from bosdyn.client.exceptions import ResponseError

    raise ResponseError(None, "no fiducial is seen")


@pytest.mark.ci
def test_things_are_put_down_on_what_the_robot_stands_at(tmp_path: Path) -> None:
    """The bed is 0.55 m high and the body 0.52 m: let go 0.12 m above it."""
    with robot() as (spot, connection):
        report = run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert report.ended.status == "done"
        assert spot.state.released_goal is not None
        frame, x, y, z = spot.state.released_goal
    assert frame == "flat_body"
    heights = {"bed": 0.55 + 0.12 - 0.52, "countertop": 0.9 + 0.12 - 0.52}
    last = [action.target for action in read(tmp_path / "run.mcap").actions if action.action == "place"][-1]
    assert z == pytest.approx(heights[last], abs=0.02)
    assert 0.6 < (x * x + y * y) ** 0.5 < 1.0


def test_where_things_are_put_down_by_hand() -> None:
    """A table of 1.2 by 0.6 m, 0.75 m high, its middle 1 m ahead of a robot that looks along y."""
    table = replace(
        load_site("paper_home").plan.containers[0],
        pose=Pose(x_m=2.0, y_m=3.0, yaw_rad=0.0),
        size_m=(1.2, 0.6, 0.75),
        base_m=0.0,
    )
    here = Pose(x_m=2.0, y_m=2.0, yaw_rad=pi / 2)
    assert place_on(table, here, 0.5) == pytest.approx((0.85, 0.0, 0.37)), "the near edge is at 0.7 m"
    tall = replace(table, size_m=(1.2, 0.6, 1.8))
    assert place_on(tall, here, 0.5)[2] == pytest.approx(1.1 + 0.12 - 0.5), "a shelf, not the top"
    far = Pose(x_m=2.0, y_m=0.0, yaw_rad=pi / 2)
    assert place_on(table, far, 0.5)[0] == pytest.approx(0.95), "no farther than the arm reaches"


@pytest.mark.ci
def test_an_arm_that_stalls_keeps_what_it_holds(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        spot.state.arm_stalls = True
        report = run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert spot.state.held is not None
        assert is_free(spot)
    assert report.ended.status != "done"
    reasons = " ".join(action.reason for action in read(tmp_path / "run.mcap").actions)
    assert "the arm stalled on the way" in reasons


def test_how_an_arm_ended_is_read_from_its_feedback() -> None:
    feedback = synchronized_command_pb2.SynchronizedCommand.Feedback()
    assert command_result(feedback).kind is ArmOutcome.RUNNING
    feedback.gripper_command_feedback.claw_gripper_feedback.status = 2
    assert command_result(feedback).kind in (ArmOutcome.RUNNING, ArmOutcome.DONE)
    feedback.arm_command_feedback.status = 2
    assert "overridden" in command_result(feedback).message
    feedback.arm_command_feedback.status = 1
    feedback.arm_command_feedback.named_arm_position_feedback.status = 3
    assert "holds something" in command_result(feedback).message


def test_a_camera_that_the_robot_does_not_have_is_said_before_recording(tmp_path: Path) -> None:
    home = load_site("paper_home")
    rates = replace(QUICK, cameras=("frontleft_fisheye_image", "periscope_image"))
    with robot(clock=RunningClock()) as (_spot, connection):
        with pytest.raises(UnknownName, match=r"periscope_image.*right_fisheye_image"):
            record_session(connection, SessionPlan(site=home, rates=rates, for_s=1.0), tmp_path / "s.mcap")
        check_cameras(connection, ("hand_color_image",))
    assert not (tmp_path / "s.mcap").exists()


@pytest.mark.ci
def test_one_sense_in_trouble_is_no_gap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The local grid's service fails all the time; everything else goes on."""

    def broken(self: object, request: object, context: Any) -> None:
        import grpc

        context.abort(grpc.StatusCode.UNAVAILABLE, "no perception today")

    monkeypatch.setattr(LocalGrids, "GetLocalGrids", broken)
    home = load_site("paper_home")
    with robot(clock=RunningClock()) as (_spot, connection):
        report = record_session(connection, SessionPlan(site=home, rates=QUICK, for_s=3.0), tmp_path / "s.mcap")
    assert report.gaps_s == ()
    assert report.failed["grid"] >= 3
    assert "grid" in report.troubles
    assert "NO grid" in report.in_words()
    assert report.taken["state"] > 10
    assert not messages(tmp_path / "s.mcap", "/session/gap")
    said = b"".join(data for *_, data in messages(tmp_path / "s.mcap", "/log"))
    assert said.count(b"The robot gives no grid") == 1


def test_pictures_come_with_where_their_camera_sits(tmp_path: Path) -> None:
    from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

    home = load_site("paper_home")
    with robot(clock=RunningClock()) as (_spot, connection):
        record_session(connection, SessionPlan(site=home, rates=QUICK, for_s=1.0), tmp_path / "s.mcap")
    links = [
        (link.parent_frame_id, link.child_frame_id)
        for *_, data in messages(tmp_path / "s.mcap", "/tf")
        for link in FrameTransforms.FromString(data).transforms
    ]
    assert ("base_link", "frontleft_fisheye") in links


def test_a_frame_tree_that_is_none_is_no_answer() -> None:
    assert tform(geometry_pb2.FrameTreeSnapshot(), "body", "odom") is None


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM, signal.SIGINT])
def test_signals_stop_and_do_not_break_off(number: signal.Signals) -> None:
    before, stop = signal.getsignal(number), StopSwitch()
    with stop_on_signals(stop):
        os.kill(os.getpid(), number)
        until = time.monotonic() + 60
        while not stop.is_pressed and time.monotonic() < until:
            time.sleep(0.01)
    assert stop.is_pressed
    assert stop.reason.startswith("stopped")
    assert signal.getsignal(number) is before


class SilentNet:
    """A way to the robot on which, once cut, old connections hear nothing ever again, as out of an access point's
    reach; new ones get through when it is mended."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._cut = threading.Event()
        self._dead: set[int] = set()
        self._links: list[socket.socket] = []
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._server.getsockname()[1])
        threading.Thread(target=self._accept, daemon=True).start()

    def cut(self) -> None:
        self._cut.set()
        self._dead |= {id(link) for link in self._links}

    def mend(self) -> None:
        self._cut.clear()

    def close(self) -> None:
        self._server.close()
        for link in self._links:
            link.close()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._server.accept()
            except OSError:
                return
            far = socket.create_connection(("127.0.0.1", self._to))
            self._links += [near, far]
            if self._cut.is_set():
                self._dead |= {id(near), id(far)}
            for a, b in ((near, far), (far, near)):
                threading.Thread(target=self._pass, args=(a, b), daemon=True).start()

    def _pass(self, a: socket.socket, b: socket.socket) -> None:
        try:
            while data := a.recv(65536):
                if id(a) not in self._dead:
                    b.sendall(data)
        except OSError:
            return


@contextmanager
def silent_net(port: int) -> Iterator[SilentNet]:
    net = SilentNet(port)
    try:
        yield net
    finally:
        net.close()


@pytest.mark.slow
def test_connections_that_die_silently_are_made_anew(tmp_path: Path) -> None:
    """Without keep-alive the client would wait for the old connection until the kernel gives up, many minutes."""
    home = load_site("paper_home")
    with robot(clock=RunningClock()) as (spot, _direct), silent_net(spot.port) as net:
        certificate = spot.write_certificate(tmp_path / "robot.pem")
        with Connection(
            RobotAddress(host="127.0.0.1", port=net.port),
            Credentials(username="user", password="simulated"),
            certificate=certificate,
            timeout_s=2.0,
        ) as connection:
            threading.Timer(3.0, net.cut).start()
            threading.Timer(8.0, net.mend).start()
            plan = SessionPlan(site=home, rates=replace(QUICK, images_hz=1.0), for_s=35.0)
            report = record_session(connection, plan, tmp_path / "s.mcap")
    gaps = [msgspec.json.decode(d, type=Gap) for *_, d in messages(tmp_path / "s.mcap", "/session/gap")]
    assert len(report.gaps_s) == len(gaps) >= 1
    assert sum(report.gaps_s) < 20.0, "back within seconds of the mending"
    last = max(log_time for _, log_time, _, _ in messages(tmp_path / "s.mcap", "/spot/robot_state"))
    assert last - gaps[-1].end.ns > 5e9
    assert read(tmp_path / "s.mcap").complete
