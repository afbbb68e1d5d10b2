"""The identity (run info) of recordings made on a robot."""

from __future__ import annotations

from bosdyn.api import payload_pb2, robot_id_pb2
from bosdyn.api.graph_nav import map_pb2

from recorders.run_identity import Driver, run_id, run_info
from recorders.spot.client.connection import ROBOT_ERRORS, Connection
from recorders.spot.client.graph_nav_map import graph_hash
from workbench.log_schema.events import RunInfo
from workbench.planning.tasks import Task
from workbench.worlds.sites.site import Site


def robot_run_info(
    connection: Connection, site: Site, task: Task, driver: Driver, *, title: str = "", id_salt: str
) -> RunInfo:
    """The identity of a run that starts now.

    Args:
        id_salt: further input of the run id, besides the robot's serial number and the time.
    """
    started_ns = connection.clock.now_ns()
    return run_info(
        task,
        driver,
        id=run_id(f"{connection.serial}|{started_ns}|{id_salt}"),
        place=site.name,
        started_ns=started_ns,
        source="spot",
        title=title,
        inertial_frame="odom",
    )


SIMULATED_SOFTWARE = "simulated"
"""The name of a simulated robot's software release."""
MAP_TIMEOUT_S = 60.0


def robot_metadata(connection: Connection, *, operator: str = "", serial: bool = True) -> dict[str, str]:
    """Which robot it is, for a log: nickname, software, whether simulated, map's hash, payloads,
    operator, and the serial number.

    What the robot does not report is left out.

    Args:
        serial: whether the serial number and the nickname, which name one robot, are given.
    """
    robot_id: robot_id_pb2.RobotId = connection.client("robot-id").get_id(timeout=connection.timeout_s)
    has = robot_id.software_release.version
    known = {
        "species": robot_id.species,
        "software": f"{has.major_version}.{has.minor_version}.{has.patch_level}",
        "simulated": "true" if robot_id.software_release.name == SIMULATED_SOFTWARE else "",
        "operator": operator,
        **({"serial": robot_id.serial_number, "nickname": robot_id.nickname} if serial else {}),
    }
    try:
        graph: map_pb2.Graph = connection.client("graph-nav-service").download_graph(timeout=MAP_TIMEOUT_S)
        known["map"] = graph_hash(graph) if graph.waypoints else ""
    except ROBOT_ERRORS:
        pass
    try:
        payloads: list[payload_pb2.Payload] = connection.client("payload").list_payloads(timeout=connection.timeout_s)
        known["payloads"] = ", ".join(sorted(payload.name for payload in payloads))
    except ROBOT_ERRORS:
        pass
    return {name: text for name, text in known.items() if text}
