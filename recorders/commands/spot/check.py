"""`lios spot check`: what forbids a run on a robot, on one screen, before anything moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from recorders.commands.spot.options import (
    FRONT_CAMERAS,
    IMAGES_HZ,
    Cameras,
    Certificate,
    ImagesHz,
    SiteOption,
    camera_names,
    check_within,
)
from workbench.options import Json
from workbench.parameters import Option


def check(
    site: SiteOption,
    robot: Annotated[
        str, Option("--robot", help="HOST or HOST:PORT of the robot; without it only --map is checked.")
    ] = "",
    map_folder: Annotated[
        Path | None, Option("--map", help="GraphNav map that the run would upload, checked on this computer.")
    ] = None,
    output: Annotated[
        Path, Option("--output", "-o", help="The log that the run would write: its disk is checked.")
    ] = Path("run.mcap"),
    cameras: Cameras = FRONT_CAMERAS,
    images_hz: ImagesHz = IMAGES_HZ,
    take_lease: Annotated[bool, Option("--take-lease", help="The run would take the lease from its owner.")] = False,
    own_estop: Annotated[bool, Option("--own-estop", help="The run would use its own e-stop endpoint.")] = False,
    certificate: Certificate = None,
    json: Json = False,
) -> None:
    """Check a robot, its map and the disk before a run; nothing moves and nothing on the robot is changed.

    E-stop, lease, battery, dock, faults, map, localisation, cameras, disk, link, clock, licence, software. Ends with
    exit code 1 if something forbids a run.

    Examples:

        lios spot check --robot 192.168.80.3 --site home/site.yaml

        lios spot check --site home/site.yaml --map home/map.walk
    """
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.spot.checks.findings import forbid_a_run, in_lines
    from recorders.spot.checks.map_checks import folder_findings
    from recorders.spot.checks.robot_checks import CheckPlan, robot_findings
    from recorders.spot.client.connection import Connection, RobotAddress, find_credentials, talking_to
    from workbench.errors import BadValue
    from workbench.terminal import emit_json, emit_text, say
    from workbench.worlds.sites.site import load_site

    if not robot and map_folder is None:
        raise BadValue("--robot", None, "given, or --map with the folder of a map")
    check_within("--images-hz", images_hz, 0, 60)
    place = load_site(site)
    in_folder, graph = ([], None) if map_folder is None else folder_findings(map_folder, place)
    found = list(in_folder)
    if robot:
        wanted = CheckPlan(
            site=place,
            cameras=camera_names(cameras) if images_hz > 0 else (),
            images_hz=images_hz,
            take_lease=take_lease,
            own_estop=own_estop,
            new_map=graph,
        )
        address = RobotAddress.read(robot)
        with talking_to(address), Connection(address, find_credentials(), certificate=certificate) as connection:
            found = [*robot_findings(connection, wanted, output), *found]
    bad = forbid_a_run(found)
    if json:
        emit_json({"ready": not bad, "findings": [finding.as_json() for finding in found]})
    else:
        emit_text(in_lines(found))
        say("Something forbids a run." if bad else "Nothing forbids a run.")
    if bad:
        raise click.exceptions.Exit(1)
