"""Localisation of a robot on its map by the nearest fiducial in view."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from typing import TYPE_CHECKING

from bosdyn.api import robot_state_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, nav_pb2
from bosdyn.client.exceptions import ResponseError
from bosdyn.client.frame_helpers import BODY_FRAME_NAME, ODOM_FRAME_NAME

from recorders.spot.client.frame_trees import tform
from recorders.spot.client.localization import Localization
from workbench.log_schema.events import NANO

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld

LOCALIZE_TIMEOUT_S = 20.0
"""Time limit of the call, which takes the robot, or a slow network, longer than others."""


def localize_by_fiducial(world: SpotWorld, *, keep: bool = False) -> Localization | None:
    """Localise the robot by the nearest fiducial; None if it sees none.

    Args:
        keep: whether a robot that says that it is localised is left so.

    Raises:
        RunStopped: as for every call.
    """

    if keep and world.body_pose() is not None:
        return replace(_localization(world), tag=None, kept=True)

    def find() -> None:
        state: robot_state_pb2.RobotState = world.connection.client("robot-state").get_robot_state(
            timeout=world.connection.timeout_s
        )
        body = tform(state.kinematic_state.transforms_snapshot, ODOM_FRAME_NAME, BODY_FRAME_NAME)
        world.graph_nav().set_localization(
            initial_guess_localization=nav_pb2.Localization(),
            ko_tform_body=None if body is None else body.to_proto(),
            fiducial_init=graph_nav_pb2.SetLocalizationRequest.FIDUCIAL_INIT_NEAREST,
            timeout=LOCALIZE_TIMEOUT_S,
        )

    try:
        world.call(find)
    except ResponseError:
        return None
    return None if world.body_pose() is None else _localization(world)


def _localization(world: SpotWorld) -> Localization:
    """Where and by which tag the robot was just localised: the nearest seen that is no item's."""
    state, body = world.localization_state(), world.body_pose()
    at = state.localization.timestamp
    away: list[tuple[float, int]] = []
    if body is not None:
        away = [
            (hypot(seen.position[0] - body.position.x, seen.position[1] - body.position.y), seen.tag)
            for seen in world.sightings() or ()
            if seen.tag not in world.site.tags
        ]
    age_ns = world.now_ns() - world.connection.clock.from_robot(at.seconds * NANO + at.nanos)
    return Localization(
        waypoint=state.localization.waypoint_id,
        tag=min(away)[1] if away else None,
        age_s=round(age_ns / NANO, 3),
    )
