"""The identity (run info) of recordings made on a robot."""

from __future__ import annotations

import hashlib

from recorders.code_revision import revision
from recorders.spot.client.connection import Connection
from workbench import __version__
from workbench.log_schema.events import SCHEMA_VERSION, RunInfo, Stamp
from workbench.planning.tasks import Task
from workbench.worlds.sites.site import Site


def robot_run_info(
    connection: Connection,
    site: Site,
    task: Task,
    *,
    strategy: str,
    estimator: str,
    seed: int = 0,
    title: str = "",
    told_apart_by: str,
) -> RunInfo:
    """The identity of a run that starts now.

    Args:
        told_apart_by: further input of the run id, besides the robot's serial number and the time.
    """
    code, started_ns = revision(), connection.clock.now_ns()
    name = f"{connection.serial}|{started_ns}|{told_apart_by}"
    return RunInfo(
        run_id=hashlib.sha256(name.encode()).hexdigest()[:12],
        schema_version=SCHEMA_VERSION,
        place=site.name,
        scenario=task.scenario,
        strategy=strategy,
        estimator=estimator,
        seed=seed,
        started=Stamp.of(started_ns),
        title=title or task.title,
        source="spot",
        code_version=__version__,
        code_revision=code.commit,
        code_dirty=code.dirty,
        weights_sha256=estimator.partition("@")[2],
        inertial_frame="odom",
    )
