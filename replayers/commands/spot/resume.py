"""`lios spot resume`: an interrupted task on a Spot goes on with what its log, and others of the place, know."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from recorders.commands.spot.options import (
    FRONT_CAMERAS,
    IMAGES_HZ,
    LOOK_S,
    Cameras,
    Certificate,
    ContinueAfterOutage,
    DryRun,
    FurnitureOpen,
    ImagesHz,
    LogSerial,
    LookSeconds,
    OperatorName,
    OwnEstop,
    Robot,
    SiteOption,
    SpeedLimit,
    TakeLease,
)
from workbench.options import Force, Json, ServePort
from workbench.parameters import Argument, Option

DRIVEN_ANEW = "conditioned-lios"
"""The strategy that goes on where an operator drove the robot."""


def resume(
    logs: Annotated[
        list[Path], Argument(help="The log of the interrupted run, then other sessions of the same place, if any.")
    ],
    robot: Robot,
    site: SiteOption,
    held_at: Annotated[
        str,
        Option(
            "--held-at", help="The container that now holds the item that was in the gripper at the end of the log."
        ),
    ] = "",
    strategy: Annotated[str, Option("--strategy", "-s", help="Strategy; default: that of the log.")] = "",
    estimator: Annotated[str, Option("--estimator", help="Estimator; default: that of the log.")] = "",
    output: Annotated[
        Path | None, Option("--output", "-o", help="The MCAP file to write; default: LOG-resumed.mcap.")
    ] = None,
    speed: SpeedLimit = None,
    look: LookSeconds = LOOK_S,
    images_hz: ImagesHz = IMAGES_HZ,
    cameras: Cameras = FRONT_CAMERAS,
    take_lease: TakeLease = False,
    own_estop: OwnEstop = False,
    furniture_open: FurnitureOpen = False,
    go_on: ContinueAfterOutage = False,
    dry_run: DryRun = False,
    serve: ServePort = None,
    operator: OperatorName = "",
    serial: LogSerial = True,
    certificate: Certificate = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Resume an interrupted task from its log; the new log names the old one.

    What the logs show is known at the start of the new run and of its replays. Where an item was put down and
    nobody looked, the robot looks first. Containers that nobody opened are tried again.

    Examples:

        lios spot resume run.mcap --robot 192.168.80.3 --site home/site.yaml

        lios spot resume run.mcap monday.mcap --robot 192.168.80.3 --site home/site.yaml --held-at desk
    """
    from dataclasses import replace

    from recorders.commands.spot.options import camera_names, check_within
    from recorders.commands.spot.run import print_plan, print_report, run_by_keys
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.sinks.mirrored import watched
    from recorders.spot.client.connection import Connection, RobotAddress, find_credentials, talking_to
    from recorders.spot.record_session import OPERATOR
    from recorders.spot.run.run import RobotRun, setup_of
    from recorders.spot.run.run_settings import RunSettings
    from recorders.spot.session.session import Rates
    from recorders.spot.tags.pictures import require_detector
    from replayers.runs.resume_state import known_from_logs
    from replayers.runs.run import read
    from workbench.errors import BadValue, OutputExists
    from workbench.worlds.sites.site import load_site

    interrupted, *_ = logs
    output = output or interrupted.with_name(f"{interrupted.stem}-resumed.mcap")
    if output.exists() and not force and not dry_run:
        raise OutputExists(output)
    if speed is not None and not 0 < speed <= 1.6:
        raise BadValue("--speed", speed, "more than 0 and at most 1.6 m/s, Spot's own limit")
    check_within("--look", look, 0.1, 600)
    check_within("--images-hz", images_hz, 0, 60)
    place, address = load_site(site), RobotAddress.read(robot)
    require_detector(place)
    runs = [read(path) for path in logs]
    before = runs[0]
    wanted = RobotRun(
        site=place,
        task=before.task,
        strategy=strategy or (DRIVEN_ANEW if before.info.strategy == OPERATOR else before.info.strategy),
        estimator=estimator or before.info.estimator.partition("@")[0],
        seed=before.info.seed,
        costs=before.costs,
        settings=RunSettings(speed_mps=speed, look_s=look, furniture_open=furniture_open, resume=go_on),
        rates=Rates(images_hz=images_hz, cameras=camera_names(cameras)),
        earlier=known_from_logs(runs, place.plan, place.travel, held_at=held_at),
        take_lease=take_lease,
        own_estop=own_estop,
        operator_name=operator,
        log_serial=serial,
    )
    ready = setup_of(wanted)
    with talking_to(address), Connection(address, find_credentials(), certificate=certificate) as connection:
        if dry_run:
            print_plan(connection, wanted, ready)
            return
        with watched(output.name, serve) as audience:
            report = run_by_keys(connection, replace(wanted, audience=audience), ready, output, force=force)
    print_report(report, output, as_json=json)
