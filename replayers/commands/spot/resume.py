"""`lios spot resume`: an interrupted task on a Spot goes on with what its log, and others of the place, know."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from recorders.commands.spot.options import (
    FRONT_CAMERAS,
    IMAGES_HZ,
    LOOK_S,
    STOP_WITHIN_M,
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
    StopWithin,
    TakeLease,
)
from workbench.options import Force, Json, ServePort
from workbench.parameters import Argument, Option

DEFAULT_STRATEGY = "conditioned-lios"
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
    stop_within: StopWithin = STOP_WITHIN_M,
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

    What the logs show, and what people corrected in them, is known at the start of the new run and of its replays.
    Where an item was put down and nobody looked, the robot looks first. Containers that nobody opened are tried
    again.

    Examples:

        lios spot resume run.mcap --robot 192.168.80.3 --site home/site.yaml

        lios spot resume run.mcap monday.mcap --robot 192.168.80.3 --site home/site.yaml --held-at desk
    """
    from recorders.commands.spot.options import camera_names, check_run
    from recorders.commands.spot.run import connect_and_run, print_report
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.spot.client.connection import RobotAddress
    from recorders.spot.record_session import OPERATOR
    from recorders.spot.run.run import RobotRun
    from recorders.spot.run.run_settings import RunSettings
    from recorders.spot.session.session import Rates
    from recorders.spot.tags.pictures import require_detector
    from replayers.runs.resume_state import known_from_logs
    from replayers.runs.run import read
    from workbench.worlds.sites.site import load_site

    interrupted, *_ = logs
    output = output or interrupted.with_name(f"{interrupted.stem}-resumed.mcap")
    check_run(output, replaces=force or dry_run, speed=speed, look=look, images_hz=images_hz, stop_within=stop_within)
    place, address = load_site(site), RobotAddress.read(robot)
    require_detector(place)
    runs = [read(path) for path in logs]
    before = runs[0]
    wanted = RobotRun(
        site=place,
        task=before.task,
        strategy=strategy or (DEFAULT_STRATEGY if before.info.strategy == OPERATOR else before.info.strategy),
        estimator=estimator or before.info.estimator.partition("@")[0],
        seed=before.info.seed,
        costs=before.costs,
        settings=RunSettings(
            speed_mps=speed, stop_within_m=stop_within, look_s=look, furniture_open=furniture_open, resume=go_on
        ),
        rates=Rates(images_hz=images_hz, cameras=camera_names(cameras)),
        earlier=known_from_logs(
            runs, place.plan, place.travel, items=[item for _, item in sorted(place.tags.items())], held_at=held_at
        ),
        take_lease=take_lease,
        own_estop=own_estop,
        operator_name=operator,
        log_serial=serial,
    )
    report = connect_and_run(
        wanted, address, output, certificate=certificate, serve=serve, force=force, dry_run=dry_run
    )
    if report is not None:
        print_report(report, output, as_json=json)
