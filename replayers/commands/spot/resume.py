"""`lios spot resume`: an interrupted task on a Spot goes on with what its log, and others of the place, know."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from recorders.commands.spot.options import Robot, RunOptions, SiteOption
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
    options: RunOptions = RunOptions(),
) -> None:
    """Resume an interrupted task from its log; the new log names the old one.

    What the logs show, and what people corrected in them, is known at the start of the new run and of its replays.
    Where an item was put down and nobody looked, the robot looks first. Containers that nobody opened are tried
    again.

    Examples:

        lios spot resume run.mcap --robot 192.168.80.3 --site home/site.yaml

        lios spot resume run.mcap monday.mcap --robot 192.168.80.3 --site home/site.yaml --held-at desk
    """
    from recorders.commands.spot.run import connect_and_run
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.spot.client.connection import RobotAddress
    from recorders.spot.record_session import OPERATOR
    from recorders.spot.run.run import RobotRun
    from recorders.spot.tags.pictures import require_detector
    from replayers.runs.resume_state import known_from_logs
    from replayers.runs.run import read
    from workbench.worlds.sites.site import load_site

    interrupted, *_ = logs
    output = output or interrupted.with_name(f"{interrupted.stem}-resumed.mcap")
    options.check(output)
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
        settings=options.settings(),
        rates=options.rates(),
        earlier=known_from_logs(
            runs, place.plan, place.travel, items=[item for _, item in sorted(place.tags.items())], held_at=held_at
        ),
        take_lease=options.take_lease,
        own_estop=options.own_estop,
        operator_name=options.operator,
        log_serial=options.serial,
    )
    connect_and_run(wanted, address, output, options)
