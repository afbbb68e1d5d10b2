"""The identity (run info) of recordings made on a robot."""

from __future__ import annotations

from recorders.run_identity import Driver, run_id, run_info
from recorders.spot.client.connection import Connection
from workbench.log_schema.events import RunInfo
from workbench.planning.tasks import Task
from workbench.worlds.sites.site import Site


def robot_run_info(
    connection: Connection, site: Site, task: Task, driver: Driver, *, title: str = "", told_apart_by: str
) -> RunInfo:
    """The identity of a run that starts now.

    Args:
        told_apart_by: further input of the run id, besides the robot's serial number and the time.
    """
    started_ns = connection.clock.now_ns()
    return run_info(
        task,
        driver,
        id=run_id(f"{connection.serial}|{started_ns}|{told_apart_by}"),
        place=site.name,
        started_ns=started_ns,
        source="spot",
        title=title,
        inertial_frame="odom",
    )
