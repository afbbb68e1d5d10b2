"""A log says which robot it is of; without the serial number it does not name one robot."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader
from spot_help import placed, robot

from recorders.spot.client.graph_nav_map import graph_hash
from recorders.spot.client.time_source import RunningClock
from recorders.spot.record_session import SessionPlan, record_session
from recorders.spot.session.session import Rates
from replayers.runs.run import read
from workbench.log_schema.run_info import ROBOT_METADATA


@pytest.mark.parametrize("serial", [True, False])
def test_the_robots_identity_is_in_the_log_and_its_serial_only_if_wanted(serial: bool, tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    with robot(clock=RunningClock()) as (_, connection):
        wanted = graph_hash(connection.client("graph-nav-service").download_graph())
        plan = SessionPlan(
            site=placed()[0], rates=Rates(images_hz=0.0), for_s=0.3, operator_name="Ada", log_serial=serial
        )
        record_session(connection, plan, log)
    with log.open("rb") as stream:
        told = next(m.metadata for m in make_reader(stream).iter_metadata() if m.name == ROBOT_METADATA)
    assert (told["operator"], told["map"], told["software"]) == ("Ada", wanted, "5.0.0")
    assert told["simulated"] == "true"
    assert read(log).source_words == "Spot (simulated)"
    assert told.get("serial") == ("simulated-spot" if serial else None)
    assert ("nickname" in told) is serial
    assert (b"simulated-spot" in log.read_bytes()) is serial
