"""The map of a site: given to a robot that lost it, refused if damaged, with its waypoints found by name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import grpc
import pytest
from bosdyn.api.graph_nav import map_pb2
from spot_help import placed, robot, run_of

from recorders.spot.client.connection import Connection
from recorders.spot.client.control import Control
from recorders.spot.client.errors import MapRefused, MapUploadBrokeOff, NoMap, WaypointMissing
from recorders.spot.client.map_upload import UPLOAD_ATTEMPTS, upload_map
from recorders.spot.run.run import run_and_record
from recorders.spot.run.world import SpotWorld
from recorders.spot.simulated.services.graph_nav import GraphNav
from workbench.errors import FileMissing, MalformedFile
from workbench.worlds.house import LocationId


def test_waypoints_may_be_called_by_the_names_that_people_gave_them(tmp_path: Path) -> None:
    site, _ = placed()
    named = MappingProxyType({place: name.removeprefix("wp-") for place, name in site.waypoints.items()})
    with robot() as (spot, connection):
        world = SpotWorld(connection=connection, control=Control(connection), site=replace(site, waypoints=named))
        world.know_the_map()
        assert dict(world.site.waypoints) == dict(site.waypoints)
        wrong = MappingProxyType({**named, LocationId("bed"): "attic"})
        world.site = replace(site, waypoints=wrong)
        with pytest.raises(WaypointMissing, match="attic"):
            world.know_the_map()
        graph = connection.client("graph-nav-service").download_graph()
        twice = next(waypoint for waypoint in graph.waypoints if waypoint.id == "wp-desk")
        twice.annotations.name = "bed"
        _load(spot, connection, graph, tmp_path)
        world.site = replace(site, waypoints=named)
        with pytest.raises(WaypointMissing, match=r"bed.*several of that name"):
            world.know_the_map()


def _load(spot: Any, connection: Connection, graph: Any, folder: Path) -> None:
    _write(graph, folder)
    with Control(connection, stand=False):
        upload_map(connection, folder)


def _write(graph: Any, folder: Path) -> None:
    (folder / "graph").write_bytes(graph.SerializeToString())
    (folder / "waypoint_snapshots").mkdir(exist_ok=True)
    for waypoint in graph.waypoints:
        snapshot = map_pb2.WaypointSnapshot(id=waypoint.snapshot_id)
        (folder / "waypoint_snapshots" / waypoint.snapshot_id).write_bytes(snapshot.SerializeToString())


@pytest.mark.ci
def test_a_robot_that_was_restarted_gets_its_map_again(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        client = connection.client("graph-nav-service")
        client.write_graph_and_snapshots(str(tmp_path / "home"))
        with Control(connection, stand=False):
            client.clear_graph(connection.client("lease").lease_wallet.advance().lease_proto)
        with pytest.raises(NoMap, match="--map"):
            run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert spot.state.leases.owner is None
        run = replace(run_of(spot), map_folder=tmp_path / "home")
        report = run_and_record(connection, run, tmp_path / "run.mcap")
        assert report.ended.status == "done", report.ended.reason
        assert spot.state.leases.owner is None


def test_what_is_no_map_is_refused_before_the_lease_is_taken(tmp_path: Path) -> None:
    (tmp_path / "graph").write_bytes(b"\xff\xff no graph")
    with robot() as (spot, connection):
        for folder, error in ((tmp_path, MalformedFile), (tmp_path / "nowhere", FileMissing)):
            with pytest.raises(error):
                run_and_record(connection, replace(run_of(spot), map_folder=folder), tmp_path / "run.mcap")
        assert spot.state.leases.number == 0
    assert issubclass(MapRefused, Exception)


@pytest.mark.parametrize("missing", ["file", "slash"])
def test_a_map_with_a_part_missing_leaves_the_robots_own_map_alone(missing: str, tmp_path: Path) -> None:
    with robot() as (_spot, connection):
        client = connection.client("graph-nav-service")
        graph = client.download_graph()
        before = len(graph.waypoints)
        _write(graph, tmp_path)
        if missing == "file":
            (tmp_path / "waypoint_snapshots" / graph.waypoints[0].snapshot_id).unlink()
        else:
            graph.waypoints[0].snapshot_id = "../../graph"
            (tmp_path / "graph").write_bytes(graph.SerializeToString())
        with pytest.raises((FileMissing, MalformedFile)), Control(connection, stand=False):
            upload_map(connection, tmp_path)
        assert len(client.download_graph().waypoints) == before


def test_a_snapshot_that_the_map_does_not_name_is_not_read_from_the_disk(tmp_path: Path) -> None:
    from bosdyn.api.graph_nav import graph_nav_pb2

    (tmp_path / "secret").write_bytes(map_pb2.WaypointSnapshot(id="x").SerializeToString())
    with robot() as (_spot, connection):
        client = connection.client("graph-nav-service")
        _write(client.download_graph(), tmp_path)
        answer = graph_nav_pb2.UploadGraphResponse(unknown_waypoint_snapshot_ids=["../secret"])
        client.upload_graph = lambda *_, **__: answer
        with pytest.raises(MapRefused, match=r"\.\./secret"), Control(connection, stand=False):
            upload_map(connection, tmp_path)


@pytest.mark.parametrize(("failures", "arrives"), [(2, True), (99, False)])
def test_a_snapshot_is_sent_again_when_the_network_fails(
    failures: int, arrives: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[str] = []
    real = GraphNav.UploadWaypointSnapshot

    def flaky(self: GraphNav, requests: Any, context: Any) -> Any:
        sent.append("snapshot")
        if len(sent) <= failures:
            context.abort(grpc.StatusCode.UNAVAILABLE, "away")
        return real(self, requests, context)

    monkeypatch.setattr(GraphNav, "UploadWaypointSnapshot", flaky)
    with robot() as (_, connection):
        connection.client("graph-nav-service").write_graph_and_snapshots(str(tmp_path))
        with Control(connection, stand=False):
            if arrives:
                assert upload_map(connection, tmp_path) == len(sent) - failures
            else:
                with pytest.raises(MapUploadBrokeOff, match="holds a part of it now") as caught:
                    upload_map(connection, tmp_path)
                assert caught.value.exit_code == 1
                assert len(sent) == UPLOAD_ATTEMPTS
