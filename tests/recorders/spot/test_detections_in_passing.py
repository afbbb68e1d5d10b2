"""Tags are placed where the body was when they were seen, not where it is by the time somebody asks."""

from __future__ import annotations

import pytest
from bosdyn.api.graph_nav import nav_pb2
from spot_help import placed, robot

from recorders.spot.client.control import Control
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.simulated.faults import FaultKind
from workbench.worlds.house import LocationId
from workbench.worlds.world import ActionDone


def test_a_tag_seen_before_a_walk_stays_where_it_was() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        at = spot.state.fiducials[540]
        world = SpotWorld(
            connection=connection, control=control, site=placed()[0], settings=RunSettings(poll_s=0.5, speed_mps=1.0)
        )
        world.wait(0.5)
        spot.inject(FaultKind.TAG_NOT_SEEN)
        start = spot.state.body.pose
        assert isinstance(world.go_to(LocationId("bed")), ActionDone)
        here = spot.state.body.pose
        assert abs(here.x_m - start.x_m) + abs(here.y_m - start.y_m) > 1.0
        seen = next(one for one in world.sightings() or () if one.tag == 540)
    assert seen.position == pytest.approx(at, abs=0.1)
