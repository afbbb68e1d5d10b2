"""The check before a run: what it forbids, what it asks, and that it changes nothing."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from bosdyn.api import license_pb2
from bosdyn.api.graph_nav import map_pb2, nav_pb2
from spot_help import placed, robot

from recorders.spot.checks.disk import disk_finding
from recorders.spot.checks.findings import CheckFinding, CheckLevel
from recorders.spot.checks.robot_checks import CheckPlan, robot_findings
from recorders.spot.client.connection import Connection
from recorders.spot.client.graph_nav_map import graph_hash
from recorders.spot.simulated.basic_services import SERVICES
from recorders.spot.simulated.faults import FaultKind
from recorders.spot.simulated.robot import SimulatedState
from recorders.spot.simulated.services.server import SimulatedSpot
from workbench.cli import run

CAMERA = ("frontleft_fisheye_image",)


@pytest.fixture(scope="module")
def both() -> Iterator[tuple[SimulatedSpot, Connection]]:
    with robot() as pair:
        pair[1].client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        yield pair


def _check(connection: Connection, **plan: Any) -> dict[str, CheckFinding]:
    wanted = CheckPlan(site=placed()[0], **plan)
    return {finding.subject: finding for finding in robot_findings(connection, wanted, Path("run.mcap"))}


def _set(**values: Any) -> Callable[[SimulatedState], None]:
    def change(state: SimulatedState) -> None:
        for name, value in values.items():
            setattr(state, name, value)

    return change


@pytest.mark.parametrize(
    ("subject", "change", "back", "said"),
    [
        ("battery", lambda s: setattr(s.body, "battery", 0.2), lambda s: setattr(s.body, "battery", 0.9), "20 %"),
        ("shore power", _set(on_shore_power=True), _set(on_shore_power=False), "unplug"),
        ("dock", _set(dock=520), _set(dock=None), "undock"),
        ("fault", _set(critical_fault="hip_overheated"), _set(critical_fault=""), "hip_overheated"),
        ("fault", _set(behaviour_fault=True), _set(behaviour_fault=False), "fall"),
        ("licence", _set(licence=license_pb2.LicenseInfo.STATUS_EXPIRED), _set(licence=1), "expired"),
        ("e-stop", lambda s: None, lambda s: None, "nobody"),
    ],
)
def test_what_keeps_a_robot_from_running_forbids_it(
    subject: str, change: Any, back: Any, said: str, both: tuple[SimulatedSpot, Connection]
) -> None:
    spot, connection = both
    with spot.state.alive() as state:
        change(state)
    try:
        found = _check(connection)[subject]
    finally:
        with spot.state.alive() as state:
            back(state)
    assert found.level is CheckLevel.FORBIDS
    assert said in found.text


def test_a_ready_robot_is_told_so_and_not_changed(both: tuple[SimulatedSpot, Connection]) -> None:
    spot, connection = both
    commands, localized = spot.state.next_command, spot.state.localized
    found = _check(connection, own_estop=True, cameras=CAMERA)
    assert not [finding for finding in found.values() if finding.level is CheckLevel.FORBIDS]
    for subject in ("robot", "software", "e-stop", "lease", "battery", "dock", "faults", "map", "camera", "disk"):
        assert found[subject].level is CheckLevel.OK, found[subject]
    assert "client 5." in found["software"].text
    assert "min at" in found["disk"].text
    assert (spot.state.next_command, spot.state.localized) == (commands, localized)
    assert spot.state.leases.number == 0, "no lease was taken"
    assert not spot.state.estop.endpoints


def test_a_missing_camera_and_waypoint_are_named(both: tuple[SimulatedSpot, Connection]) -> None:
    _, connection = both
    client = connection.client("graph-nav-service")
    graph, real = client.download_graph(), client.download_graph
    gone = graph.waypoints.pop()
    graph.anchoring.objects.add(id=str(min(placed()[0].tags)))
    client.download_graph = lambda **_: graph
    try:
        found = _check(connection, cameras=("periscope_image",))
    finally:
        client.download_graph = real
    assert "periscope_image" in found["camera"].text
    assert gone.id in found["waypoints"].text
    assert "same tags" in found["fiducials"].text, "the robot would localise itself by an item that is carried about"
    for subject in ("camera", "waypoints", "fiducials"):
        assert found[subject].level is CheckLevel.FORBIDS


def test_a_lease_of_another_forbids_unless_it_is_to_be_taken() -> None:
    with robot() as (spot, connection):
        spot.inject(FaultKind.LOST_LEASE)
        assert _check(connection)["lease"].level is CheckLevel.FORBIDS
        assert _check(connection, take_lease=True)["lease"].level is CheckLevel.WARNING


def test_a_robot_of_older_software_lacks_services_and_is_checked_for_the_rest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("docking", "license"):
        monkeypatch.delitem(SERVICES, name)
    with robot() as (_, connection):
        found = _check(connection)
    assert found["dock"].level is found["licence"].level is CheckLevel.WARNING
    assert "does not say" in found["dock"].text
    assert found["battery"].level is CheckLevel.OK


def test_a_map_is_checked_on_this_computer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    site, _ = placed()
    graph = map_pb2.Graph()
    for place, name in site.waypoints.items():
        graph.waypoints.add(id=name, snapshot_id=f"s-{place}")
    (tmp_path / "waypoint_snapshots").mkdir()
    for waypoint in graph.waypoints:
        (tmp_path / "waypoint_snapshots" / waypoint.snapshot_id).write_bytes(
            map_pb2.WaypointSnapshot(id=waypoint.snapshot_id).SerializeToString()
        )
    (tmp_path / "graph").write_bytes(graph.SerializeToString())
    asked = ["spot", "check", "--site", "paper_home", "--map", str(tmp_path), "--json"]
    assert run(asked) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["ready"]
    assert graph_hash(graph) in told["findings"][0]["text"]
    (tmp_path / "waypoint_snapshots" / graph.waypoints[0].snapshot_id).unlink()
    assert run(asked) == 1
    assert "no such file" in capsys.readouterr().out
    assert run(["spot", "check", "--site", "paper_home"]) == 2
    assert "--robot" in capsys.readouterr().err


def test_the_disk_is_told_in_minutes(tmp_path: Path) -> None:
    assert disk_finding(tmp_path / "x.mcap", 1.0).level is CheckLevel.OK
    assert disk_finding(tmp_path / "x.mcap", 1e15).level is CheckLevel.FORBIDS
    assert disk_finding(tmp_path / "nowhere" / "x.mcap", 1.0).level is CheckLevel.FORBIDS
