"""The robot services that a run or a recording needs, and which of them its software lacks."""

from __future__ import annotations

from collections.abc import Iterable

from bosdyn.api import directory_pb2

from recorders.spot.client.connection import Connection
from recorders.spot.client.errors import ServiceMissing
from workbench.worlds.sites.site import Site

SENSES = ("robot-state", "graph-nav-service", "world-objects")
"""Services that localise the robot and see its tags."""
MOTION = ("lease", "estop", "power", "robot-command")
"""Services that a robot is driven by."""


def services_of_a_run(site: Site, cameras: Iterable[str] = ()) -> tuple[str, ...]:
    """The services that a run at a site needs, by their names in the robot's directory."""
    arm = ("manipulation",) if site.robot.arm else ()
    dock = ("docking",) if site.robot.dock is not None else ()
    return (*SENSES, *MOTION, *arm, *dock, *services_of_cameras(cameras))


def services_of_cameras(cameras: Iterable[str]) -> tuple[str, ...]:
    """The service that pictures need, if there are cameras."""
    return ("image",) if any(True for _ in cameras) else ()


def missing_services(connection: Connection, needed: Iterable[str]) -> tuple[str, ...]:
    """Those of the needed services that are not in the robot's directory."""
    entries: list[directory_pb2.ServiceEntry] = connection.client("directory").list(timeout=connection.timeout_s)
    listed = {entry.name for entry in entries}
    return tuple(name for name in needed if name not in listed)


def require_services(connection: Connection, needed: Iterable[str]) -> None:
    """Check that the robot has all services that are needed, before anything moves.

    Raises:
        ServiceMissing: its software lacks some.
    """
    missing = missing_services(connection, needed)
    if missing:
        raise ServiceMissing(str(connection.address), missing, connection.software)
