"""The official client talks to the simulated robot as to a real one: every service that the project uses."""

from __future__ import annotations

import io
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import bosdyn.client
import numpy as np
import pytest
from bosdyn.api import image_pb2, world_object_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, nav_pb2
from bosdyn.client.auth import InvalidLoginError
from bosdyn.client.estop import EstopEndpoint, EstopKeepAlive
from bosdyn.client.exceptions import UnauthenticatedError
from bosdyn.client.frame_helpers import get_a_tform_b
from bosdyn.client.image import build_image_request
from bosdyn.client.lease import LeaseKeepAlive
from bosdyn.client.robot_command import RobotCommandBuilder, blocking_stand
from PIL import Image
from spot_help import placed, robot, run_of

from recorders.spot.client.connection import Connection, Credentials, RobotAddress
from recorders.spot.client.control import Control
from recorders.spot.client.errors import BadLogin, Estopped, LeaseTaken, NoEstop, RobotUnreachable
from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.navigate import speed_limit
from recorders.spot.run.operator import StopSwitch
from recorders.spot.run.run import run_and_record
from recorders.spot.simulated.services.server import PortTaken, SimulatedSpot
from replayers.runs.run import read


def test_the_official_client_does_what_hello_spot_does(tmp_path: Path) -> None:
    """Boston Dynamics' first example, line by line: log in, time sync, e-stop, lease, power, stand, picture, off."""
    site, house = placed()
    with SimulatedSpot(site, house, clock=RunningClock(skew_s=-7.25, speed_up=20)) as spot:
        sdk = bosdyn.client.create_standard_sdk(
            "hello", cert_resource_glob=str(spot.write_certificate(tmp_path / "c.pem"))
        )
        client = sdk.create_robot(spot.address)
        client.update_secure_channel_port(spot.port)
        assert client.get_id().species == "spot"
        with pytest.raises(InvalidLoginError):
            client.authenticate("user", "wrong")
        client.authenticate("user", "simulated")
        client.time_sync.wait_for_sync(timeout_sec=60)
        skew, trip = client.time_sync.endpoint.clock_skew, client.time_sync.endpoint.round_trip_time
        allowed_s = max(0.005, trip.seconds / 2 + trip.nanos * 0.5e-9)
        assert skew.seconds + skew.nanos * 1e-9 == pytest.approx(-7.25, abs=allowed_s)
        assert {"lease", "graph-nav-service", "world-objects"} <= {service.name for service in client.list_services()}
        assert client.has_arm()
        assert not client.is_estopped(), "a robot without endpoints may report that nothing stops it"
        endpoint = EstopEndpoint(client.ensure_client("estop"), "test", 9.0)
        endpoint.force_simple_setup()
        leases = client.ensure_client("lease")
        with EstopKeepAlive(endpoint) as stop, LeaseKeepAlive(leases, must_acquire=True, return_at_exit=True):
            stop.allow()
            assert not client.is_estopped()
            client.power_on(timeout_sec=60)
            assert client.is_powered_on()
            blocking_stand(client.ensure_client("robot-command"), timeout_sec=60)
            client.power_off(cut_immediately=False, timeout_sec=60)
            assert not client.is_powered_on()
            stop.shutdown()
        assert spot.state.leases.owner is None
        sdk.clear_robots()
        client.shutdown()


def test_nothing_is_answered_without_a_token(tmp_path: Path) -> None:
    site, house = placed()
    with SimulatedSpot(site, house) as spot:
        sdk = bosdyn.client.create_standard_sdk(
            "x", cert_resource_glob=str(spot.write_certificate(tmp_path / "c.pem"))
        )
        client = sdk.create_robot(spot.address)
        client.update_secure_channel_port(spot.port)
        with pytest.raises(UnauthenticatedError):
            client.list_services()
        sdk.clear_robots()
        client.shutdown()


def test_a_client_that_trusts_another_root_does_not_connect() -> None:
    site, house = placed()
    with SimulatedSpot(site, house) as spot:
        address = RobotAddress(host=spot.address, port=spot.port)
        with pytest.raises(RobotUnreachable):
            Connection(address, Credentials(username="user", password="simulated"), timeout_s=1.0)


def other_client(spot: SimulatedSpot, address: RobotAddress) -> Connection:
    """A second connection; closed when it is collected."""
    with tempfile.TemporaryDirectory() as folder:
        certificate = spot.write_certificate(Path(folder) / "c.pem")
        return Connection(address, Credentials(username="user", password="simulated"), certificate=certificate)


def test_graph_nav_walks_to_waypoints_along_the_map_and_tags_are_listed() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True):
        clock, nav = connection.clock, connection.client("graph-nav-service")
        assert nav.get_localization_state().localization.waypoint_id == ""
        nav.set_localization(nav_pb2.Localization())
        graph = nav.download_graph()
        assert {"wp-fridge", "wp-bed", "wp-start"} <= {waypoint.id for waypoint in graph.waypoints}
        assert len(graph.edges) == len(graph.waypoints) - 1
        anchors = {anchor.id: anchor.seed_tform_waypoint.position for anchor in graph.anchoring.anchors}
        clock.refresh()
        number = nav.navigate_to(
            "wp-countertop", 100.0, travel_params=nav.generate_travel_params(0.25, 0.2, speed_limit(0.5))
        )
        answer, steps = graph_nav_pb2.NavigationFeedbackResponse, 0
        while nav.navigation_feedback(number).status == answer.STATUS_FOLLOWING_ROUTE:
            clock.sleep(0.5)
            steps += 1
        assert nav.navigation_feedback(number).status == answer.STATUS_REACHED_GOAL
        metres = spot.state.site.travel.between("start", "countertop")  # type: ignore[arg-type]
        assert metres is not None
        assert 0.5 * steps == pytest.approx(metres / 0.5, rel=0.2)
        here = nav.get_localization_state().localization
        assert here.waypoint_id == "wp-countertop"
        at = anchors["wp-countertop"]
        assert (here.seed_tform_body.position.x, here.seed_tform_body.position.y) == pytest.approx(
            (at.x, at.y), abs=0.01
        )
        tags = connection.client("world-objects").list_world_objects([world_object_pb2.WORLD_OBJECT_APRILTAG])
        bottle = next(o for o in tags.world_objects if o.apriltag_properties.tag_id == 101)
        seen = get_a_tform_b(bottle.transforms_snapshot, "body", bottle.apriltag_properties.frame_name_fiducial)
        assert seen is not None
        assert 0.3 < seen.x < 1.0, "in front of the robot"


def test_odd_commands_are_refused_as_a_robot_refuses_them() -> None:
    from bosdyn.client.graph_nav import RobotNotLocalizedToRouteError, UnknownWaypointError
    from bosdyn.client.robot_command import NotPoweredOnError

    with robot() as (_spot, connection), Control(connection, stand=False):
        nav, commands = connection.client("graph-nav-service"), connection.client("robot-command")
        with pytest.raises(UnknownWaypointError):
            nav.navigate_to("wp-cellar", 10.0)
        with pytest.raises(NotPoweredOnError):
            commands.robot_command(RobotCommandBuilder.synchro_stand_command())
    with robot() as (_spot, connection), Control(connection, own_estop=True):
        connection.clock.refresh()
        with pytest.raises(RobotNotLocalizedToRouteError):
            connection.client("graph-nav-service").navigate_to("wp-bed", 10.0)


def test_pictures_and_grids_come_as_from_a_robot() -> None:
    with robot() as (_spot, connection):
        images, grids = connection.client("image"), connection.client("local-grid-service")
        assert "frontleft_fisheye_image" in {source.name for source in images.list_image_sources()}
        first, depth = images.get_image(
            [build_image_request("frontleft_fisheye_image", resize_ratio=0.5), build_image_request("frontleft_depth")]
        )
        picture = Image.open(io.BytesIO(first.shot.image.data))
        assert picture.size == (320, 240)
        assert np.asarray(picture).std() > 10, "walls and floor differ"
        assert depth.shot.image.pixel_format == image_pb2.Image.PIXEL_FORMAT_DEPTH_U16
        answer = grids.get_local_grids(["obstacle_distance"])[0]
        assert sum(answer.local_grid.rle_counts) == 128 * 128


def test_one_commands_and_the_other_waits() -> None:
    with robot() as (spot, connection), Control(connection, stand=False):
        address = RobotAddress(host=spot.address, port=spot.port)
        assert spot.state.leases.owner is not None
        ours = spot.state.leases.owner.client_name
        with pytest.raises(LeaseTaken, match="holds the lease"), Control(other_client(spot, address), stand=False):
            pass
        assert spot.state.leases.owner.client_name == ours


def test_an_emergency_stop_that_is_not_ours_is_left_alone_and_the_lease_given_back() -> None:
    with robot() as (spot, connection):
        tablet = EstopEndpoint(connection.client("estop"), "tablet", 600.0)
        tablet.force_simple_setup()
        tablet.stop()
        with pytest.raises(Estopped, match="--own-estop"), Control(connection):
            pass
        assert spot.state.leases.owner is None
        tablet.allow()
        with Control(connection) as control:
            assert control.estop_guard == "tablet"
        with Control(connection, own_estop=True) as control:
            assert control.estop_guard == "lios-workbench", "asked for, so registered whatever the level is"
            assert [e.proto.name for e in spot.state.estop.endpoints.values()] == ["lios-workbench"]


def test_a_live_tablet_endpoint_is_neither_replaced_nor_left_alone_silently(caplog: pytest.LogCaptureFixture) -> None:
    with robot() as (_, connection):
        with Control(connection, own_estop=True) as control:
            assert control.estop_replaced == ""
        assert "replaces" not in caplog.text, "there was none to replace"
        tablet = EstopEndpoint(connection.client("estop"), "tablet", 600.0)
        tablet.force_simple_setup()
        tablet.allow()
        with Control(connection) as control:
            assert control.estop_in_words().startswith("The e-stop of tablet guards this run")
            assert "motors stay on" in control.estop_in_words()
        assert "replaces" not in caplog.text
        with Control(connection, own_estop=True) as control:
            assert control.estop_replaced == "tablet"
            assert "9 s after this program is killed" in control.estop_in_words()
        warned = [entry.getMessage() for entry in caplog.records if entry.levelname == "WARNING"]
        assert "--own-estop replaces the e-stop of tablet" in warned


@pytest.mark.parametrize("own", [True, False])
def test_a_run_says_whose_emergency_stop_guards_it(
    own: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stop = StopSwitch()
    stop.press("enough")
    with robot() as (spot, connection):
        tablet = EstopEndpoint(connection.client("estop"), "tablet", 600.0)
        tablet.force_simple_setup()
        tablet.allow()
        run_and_record(
            connection, replace(run_of(spot, stop_within_m=0.5), own_estop=own), tmp_path / "run.mcap", stop=stop
        )
    said = capsys.readouterr().err
    assert ("Our own e-stop" if own else "The e-stop of tablet") in said
    assert "within 0.5 m" in said
    told = read(tmp_path / "run.mcap").settings["spot"]
    assert (told["estop_guard"], told["estop_replaced"]) == (("lios-workbench", "tablet") if own else ("tablet", ""))


@pytest.mark.parametrize("reports_none", [True, False])
def test_a_robot_without_any_emergency_stop_is_not_driven(reports_none: bool) -> None:
    """A robot without endpoints may report that nothing stops it."""
    with robot() as (spot, connection):
        spot.state.estop.open_without_endpoints = reports_none
        with pytest.raises(NoEstop, match="--own-estop"), Control(connection):
            pass
        assert spot.state.leases.owner is None
        with Control(connection, own_estop=True) as control:
            assert control.estop_guard == "lios-workbench"
            assert spot.state.estop.endpoints


def test_a_wrong_password_and_nobody_at_the_address(tmp_path: Path) -> None:
    site, house = placed()
    with SimulatedSpot(site, house) as spot:
        certificate = spot.write_certificate(tmp_path / "c.pem")
        address = RobotAddress(host=spot.address, port=spot.port)
        with pytest.raises(BadLogin, match="BOSDYN_CLIENT_PASSWORD") as caught:
            Connection(address, Credentials(username="user", password="guess-me"), certificate=certificate)
        assert "guess-me" not in str(caught.value)
        with pytest.raises(PortTaken):
            SimulatedSpot(site, house, port=spot.port)
    with pytest.raises(RobotUnreachable, match="does not answer"):
        Connection(address, Credentials(username="user", password="x"), certificate=certificate, timeout_s=1.0)


def test_the_network_comes_back_on_the_same_port_with_the_same_tokens(tmp_path: Path) -> None:
    with robot(clock=RunningClock()) as (spot, connection):
        state = connection.client("robot-state")
        state.get_robot_state()
        spot.drop(0.5)
        with pytest.raises(bosdyn.client.exceptions.RpcError):
            state.get_robot_state(timeout=0.3)
        end = time.monotonic() + 60
        while True:
            try:
                state.get_robot_state(timeout=0.5)
                break
            except bosdyn.client.exceptions.RpcError:
                assert time.monotonic() < end, "the robot did not come back"
                time.sleep(0.1)
