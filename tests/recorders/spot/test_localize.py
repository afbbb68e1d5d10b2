"""A run from where no fiducial is in view: the robot's localisation is trusted where the operator says so."""

from __future__ import annotations

from pathlib import Path

import pytest
from bosdyn.api.graph_nav import nav_pb2
from spot_help import robot, run_of

from recorders.spot.client.errors import NotLocalized
from recorders.spot.run.run import first_decision, run_and_record
from recorders.spot.simulated.faults import FaultKind
from replayers.runs.run import read


def test_a_robot_stays_localised_as_it_says_where_the_operator_says_so(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        spot.state.fiducials_from_floor = False
        with pytest.raises(NotLocalized, match="fiducial"):
            first_decision(connection, run_of(spot))
        trusting = run_of(spot, keep_localization=True)
        assert first_decision(connection, trusting) is not None
        report = run_and_record(connection, trusting, tmp_path / "run.mcap")
    assert report.ended.status == "done", report.ended.reason
    told = read(tmp_path / "run.mcap").settings["spot"]["localization"]
    assert told["kept"], "no fiducial was asked, and the log says so"
    assert told["tag"] is None
    assert told["waypoint"].startswith("wp-")


def test_a_robot_that_is_lost_is_not_trusted() -> None:
    with robot() as (spot, connection):
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        spot.state.fiducials_from_floor = False
        spot.inject(FaultKind.LOST_LOCALIZATION)
        with pytest.raises(NotLocalized, match="fiducial"):
            first_decision(connection, run_of(spot, keep_localization=True))
