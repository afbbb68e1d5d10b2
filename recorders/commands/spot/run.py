"""`lios spot run`: runs a task on a Spot and records it, with an operator at the keys."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from recorders.commands.spot.options import Robot, RunOptions, SiteOption
from workbench.options import MemoryLogs, MoveRatesFile
from workbench.parameters import Option

if TYPE_CHECKING:
    from recorders.spot.client.connection import Connection, RobotAddress
    from recorders.spot.run.run import RobotRun, RunReport
    from workbench.execution.setup import RunSetup


def run(
    robot: Robot,
    site: SiteOption,
    task: Annotated[Path | None, Option("--task", help="The task (YAML); default: deliver.yaml of the site.")] = None,
    strategy: Annotated[str, Option("--strategy", "-s", help="Strategy by name.")] = "conditioned-lios",
    estimator: Annotated[
        str,
        Option("--estimator", help="counts, fcnn, best, people, mixed, a .safetensors, a .prompt, or module:Class."),
    ] = "best",
    output: Annotated[Path, Option("--output", "-o", help="The MCAP file to write.")] = Path("run.mcap"),
    map_folder: Annotated[
        Path | None, Option("--map", help="GraphNav map to upload first (folder with graph, *_snapshots).")
    ] = None,
    memory: MemoryLogs = None,
    rates: MoveRatesFile = None,
    seed: Annotated[int, Option("--seed", help="Seed passed to the strategy.")] = 0,
    options: RunOptions = RunOptions(),
) -> None:
    """Run a task on a Spot and record it; the lease is always returned.

    Keys: space or s stops the robot and ends the run, p pauses it and g lets it go on, k skips the container at hand,
    i says that an item is there, n marks the moment. A status line shows battery, localisation, link, tags and what
    is next. Without an arm, an operator confirms by key. A robot that gets no command stops by itself, within
    --stop-within.

    Examples:

        lios spot run --robot 192.168.80.3 --site home/site.yaml --task deliver.yaml --strategy model-lios --dry-run

        lios spot run --robot 127.0.0.1:50443 --certificate spot-simulated.pem --site paper_home --own-estop
    """
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.earlier_runs import memory_now
    from recorders.spot.client.connection import RobotAddress
    from recorders.spot.run.run import RobotRun
    from recorders.spot.run.site_tasks import delivery_of, site_task
    from recorders.spot.tags.pictures import require_detector
    from workbench.worlds.sites.site import load_site

    options.check(output)
    place, address = load_site(site), RobotAddress.read(robot)
    require_detector(place)
    wanted = RobotRun(
        site=place,
        task=site_task(task or delivery_of(place), place),
        strategy=strategy,
        estimator=estimator,
        seed=seed,
        settings=options.settings(),
        rates=options.rates(),
        take_lease=options.take_lease,
        own_estop=options.own_estop,
        map_folder=map_folder,
        operator_name=options.operator,
        log_serial=options.serial,
        memory=memory_now(memory, rates, place.plan),
    )
    connect_and_run(wanted, address, output, options)


def connect_and_run(wanted: RobotRun, address: RobotAddress, output: Path, options: RunOptions) -> None:
    """Connect to the robot, run, and print how it ended; with --dry-run print the first plan only."""
    from recorders.sinks.mirrored import watched
    from recorders.spot.client.connection import Connection, find_credentials, talking_to
    from recorders.spot.run.run import setup_of

    ready = setup_of(wanted)
    certificate = options.certificate
    with talking_to(address), Connection(address, find_credentials(), certificate=certificate) as connection:
        if options.dry_run:
            print_plan(connection, wanted, ready)
            return
        with watched(output.name, options.serve) as audience:
            report = run_by_keys(connection, replace(wanted, audience=audience), ready, output, force=options.force)
    print_report(report, output, as_json=options.json)


def print_plan(connection: Connection, wanted: RobotRun, ready: RunSetup) -> None:
    """Print the first decision without moving the robot."""
    from recorders.spot.run.event_text import event_line
    from recorders.spot.run.run import first_decision
    from workbench.terminal import say

    planned = first_decision(connection, wanted, ready)
    say(f"{connection.serial} is localised and all waypoints of {wanted.site.name} are on its map.")
    say(event_line(planned) if planned is not None else "The goal is met already: nothing to do.")


def run_by_keys(connection: Connection, wanted: RobotRun, ready: RunSetup, output: Path, *, force: bool) -> RunReport:
    """Run with progress output and keyboard control."""
    from recorders.spot.run.event_text import event_line
    from recorders.spot.run.operator import KeyboardOperator, StopSwitch, stop_on_signals
    from recorders.spot.run.operator_requests import RUN_KEYS
    from recorders.spot.run.run import run_and_record
    from recorders.spot.run.status_line import status_line
    from workbench.terminal import say

    stop = StopSwitch()
    say(RUN_KEYS)
    with stop_on_signals(stop), status_line() as show, KeyboardOperator(stop) as keys:
        return run_and_record(
            connection,
            replace(wanted, show_status=show),
            output,
            setup=ready,
            stop=stop,
            operator=keys,
            force=force,
            on_event=lambda e: say(event_line(e)),
        )


def print_report(report: RunReport, output: Path, *, as_json: bool) -> None:
    """Print how a run ended and where it was recorded."""
    from workbench.terminal import counted, emit_json, say

    end = report.ended
    if not report.lease_returned:
        say("The lease could not be returned: the robot did not answer. It frees it by itself; check at the tablet.")
    if as_json:
        emit_json(
            {
                "log": str(output),
                "status": end.status,
                "reason": end.reason,
                "cost": end.cost,
                "seconds": report.seconds,
                "searches": end.searches,
                "travel_m": end.travel_m,
                "lease_returned": report.lease_returned,
                "gaps_s": list(report.gaps),
            }
        )
    else:
        looked = counted(end.searches, "container")
        say(f"{end.status}: {report.seconds:.0f} s, {looked} searched, {end.travel_m:.1f} m walked")
        say(f"Recorded to {output}. Next: lios view {output}, or lios replay {output} --strategies all")
