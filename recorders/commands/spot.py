"""`lios spot simulate`, `record` and `run`: simulate a Spot, record a session, run a task on the robot."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.options import Force, Json, MemoryLogs, MoveRatesFile, ServePort
from workbench.parameters import Option

if TYPE_CHECKING:
    from recorders.spot.client.connection import Connection
    from recorders.spot.run.run import RobotRun, RunReport
    from workbench.execution.setup import RunSetup

Robot = Annotated[str, Option("--robot", help="HOST or HOST:PORT of the robot.")]
SiteOption = Annotated[str, Option("--site", help="Survey file (site.yaml) or a shipped site: paper_home.")]
OperatorName = Annotated[str, Option("--operator", help="Who is at the robot, for the log.")]
LogSerial = Annotated[
    bool, Option("--serial/--no-serial", help="Whether the log names the robot: its serial number and nickname.")
]
Certificate = Annotated[
    Path | None,
    Option("--certificate", help="Root certificate to trust; default Boston Dynamics' own."),
]


def simulate(
    site: SiteOption = "paper_home",
    configuration: Annotated[
        str, Option("--configuration", help="Items and start pose, by name (configurations.yaml).")
    ] = "A",
    port: Annotated[int, Option("--port", min=0, max=65535, help="Port on loopback; 0 for a free one.")] = 50443,
    speed_up: Annotated[float, Option("--speed-up", help="Speed-up of the simulated body.")] = 1.0,
    fault: Annotated[
        list[str] | None,
        Option(
            "--fault",
            help="KIND@SECONDS+DURATION; lost-lease, lost-localization, stuck, tag-not-seen, "
            "dropped, estop, clock-skew, dropped-item, expired-tokens, no-route, constraint-fault, area-callback, "
            "overridden, impaired. Repeatable.",
        ),
    ] = None,
    software: Annotated[
        str, Option("--software", help="Release of its software, 3.0.0 or later: what came later, it lacks.")
    ] = "5.0.0",
    certificate: Annotated[
        Path, Option("--certificate", help="Where to write the root certificate for clients.")
    ] = Path("spot-simulated.pem"),
    seed: Annotated[int, Option("--seed", help="Seed of the sensors' noise.")] = 0,
    for_s: Annotated[float | None, Option("--for", help="Stop after this many seconds.")] = None,
) -> None:
    """Simulate a Spot in a site; the official client connects to it as to a real robot.

    User "user", password "simulated"; loopback only. Ctrl-C ends it.

    Examples:

        lios spot simulate --site paper_home --configuration A

        lios spot simulate --fault stuck@30+10 --fault dropped@60+3
    """
    import time

    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.spot.client.software import SoftwareVersion
    from recorders.spot.client.time_source import RunningClock
    from recorders.spot.simulated.faults import read_faults
    from recorders.spot.simulated.services.server import SimulatedSpot
    from workbench.errors import BadValue
    from workbench.terminal import say
    from workbench.worlds.sites.configurations import pick_configuration, site_and_house
    from workbench.worlds.sites.site import load_site

    if not 0.01 <= speed_up <= 100:
        raise BadValue("--speed-up", speed_up, "between 0.01 and 100")
    if for_s is not None and for_s < 0:
        raise BadValue("--for", for_s, "at least 0 seconds")
    surveyed = load_site(site)
    place, house = site_and_house(surveyed, pick_configuration(surveyed, configuration))
    faults, release = read_faults(fault or ()), SoftwareVersion.read("--software", software)
    with SimulatedSpot(
        place, house, clock=RunningClock(speed_up=speed_up), port=port, faults=faults, seed=seed, software=release
    ) as robot:
        robot.write_certificate(certificate)
        try:
            say(f"A simulated Spot in {place.name}, configuration {configuration}, at {robot.address}:{robot.port}")
            say(f"Certificate: {certificate}. User: {robot.username}, password: {robot.password}. Ctrl-C ends it.")
            say(f"Next: lios spot run --robot {robot.address}:{robot.port} --certificate {certificate} --site {site}")
            ends = None if for_s is None else time.monotonic() + for_s
            while ends is None or time.monotonic() < ends:
                time.sleep(0.1)
        except KeyboardInterrupt:
            say("Stopped.")  # requested by the user: not a failure


def record(
    robot: Robot,
    site: Annotated[str, Option("--site", help="Survey file or shipped site; omit it if there is none yet.")] = "",
    output: Annotated[Path, Option("--output", "-o", help="The MCAP file to write.")] = Path("session.mcap"),
    images_hz: Annotated[float, Option("--images-hz", help="Pictures per second and camera; 0 for none.")] = 2.0,
    cameras: Annotated[
        str, Option("--cameras", help="Image sources, comma-separated.")
    ] = "frontleft_fisheye_image,frontright_fisheye_image",
    state_hz: Annotated[float, Option("--state-hz", help="Robot states per second.")] = 10.0,
    raw: Annotated[bool, Option("--raw/--no-raw", help="Also record bosdyn's original messages.")] = True,
    task: Annotated[Path | None, Option("--task", help="The task of the session (YAML), for later replays.")] = None,
    for_s: Annotated[float | None, Option("--for", help="Stop after this many seconds.")] = None,
    split_mb: Annotated[
        float | None, Option("--split-mb", help="Continue in another file (NAME_0001.mcap, ...) beyond this size.")
    ] = None,
    split_s: Annotated[
        float | None, Option("--split-s", help="Continue in another file after this many seconds.")
    ] = None,
    keep_last: Annotated[
        float | None,
        Option("--keep-last", help="Keep the last seconds in memory; written by key w, and at the end."),
    ] = None,
    furniture_open: Annotated[
        bool, Option("--furniture-open", help="Your word that all closed furniture was opened before.")
    ] = False,
    serve: ServePort = None,
    operator: OperatorName = "",
    serial: LogSerial = True,
    certificate: Certificate = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Record a Spot session: state, odometry, localisation, tags, pictures, local grid, faults, battery.

    Takes no lease and never delays the robot. Keys: n opens a line for a note, m marks the moment, o says
    that the furniture at hand was opened (else a closed container in which nothing is seen is not logged); d ends the
    session as done, f as failed, q and Ctrl-C by whether the goal is met. User name and password come from
    BOSDYN_CLIENT_USERNAME and BOSDYN_CLIENT_PASSWORD or a prompt.

    Examples:

        lios spot record --robot 192.168.80.3 --site home/site.yaml -o trial.mcap

        lios spot record --robot 127.0.0.1:50443 --certificate spot-simulated.pem --site paper_home --for 60

        lios spot record --robot 192.168.80.3 -o round.mcap && lios site from-log round.mcap -o home
    """
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.sinks.files import Split
    from recorders.sinks.mirrored import watched
    from recorders.spot.client.connection import Connection, RobotAddress, find_credentials, talking_to
    from recorders.spot.record_session import SessionPlan, record_session
    from recorders.spot.run.site_tasks import site_task
    from recorders.spot.run.status_line import status_line
    from recorders.spot.session.session import Rates
    from recorders.spot.tags.pictures import require_detector
    from workbench.errors import OutputExists
    from workbench.terminal import emit_json, say
    from workbench.worlds.sites.site import load_site, unsurveyed_site

    if output.exists() and not force:
        raise OutputExists(output)
    _check_parts(keep_last, split_mb, split_s)
    check_within("--images-hz", images_hz, 0, 60)
    check_within("--state-hz", state_hz, 0, 200)
    for option, seconds in (("--for", for_s), ("--keep-last", keep_last)):
        if seconds is not None:
            check_within(option, seconds, 0.1, 1e6)
    place = load_site(site) if site else unsurveyed_site()
    require_detector(place)
    wanted = SessionPlan(
        site=place,
        task=None if task is None else site_task(task, place),
        rates=Rates(images_hz=images_hz, state_hz=state_hz, raw=raw, cameras=camera_names(cameras)),
        for_s=for_s,
        split=Split(part_bytes=None if split_mb is None else round(split_mb * 1e6), part_s=split_s),
        keep_last_s=keep_last,
        furniture_open=furniture_open,
        operator_name=operator,
        log_serial=serial,
    )
    address = RobotAddress.read(robot)
    with (
        talking_to(address),
        Connection(address, find_credentials(), certificate=certificate) as connection,
        watched(output.name, serve) as audience,
    ):
        say(
            f"Recording {connection.serial} at {robot} to {output}. "
            "Keys: n note, m mark, o opened, d done, f failed, q end."
        )
        with status_line() as show:
            followed = replace(wanted, audience=audience, show_status=show)
            report = record_session(connection, followed, output, force=force)
    if json:
        emit_json({"log": str(output), **report.as_json()})
    else:
        say(report.in_words())


def run(
    robot: Robot,
    site: SiteOption,
    task: Annotated[Path | None, Option("--task", help="The task (YAML); default: deliver.yaml of the site.")] = None,
    strategy: Annotated[str, Option("--strategy", "-s", help="Strategy by name.")] = "conditioned-lios",
    estimator: Annotated[str, Option("--estimator", help="Estimator: counts, fcnn, best, people, mixed.")] = "best",
    output: Annotated[Path, Option("--output", "-o", help="The MCAP file to write.")] = Path("run.mcap"),
    speed: Annotated[float | None, Option("--speed", help="Speed limit in m/s.")] = None,
    look: Annotated[float, Option("--look", help="Duration of a look in seconds.")] = 6.0,
    images_hz: Annotated[float, Option("--images-hz", help="Pictures per second and camera; 0 for none.")] = 2.0,
    take_lease: Annotated[bool, Option("--take-lease", help="Take the lease from its current owner.")] = False,
    own_estop: Annotated[
        bool, Option("--own-estop", help="Guard the run by our own e-stop endpoint, instead of the tablet's.")
    ] = False,
    map_folder: Annotated[
        Path | None, Option("--map", help="GraphNav map to upload first (folder with graph, *_snapshots).")
    ] = None,
    cameras: Annotated[str, Option("--cameras", help="Image sources, comma-separated.")] = (
        "frontleft_fisheye_image,frontright_fisheye_image"
    ),
    furniture_open: Annotated[
        bool, Option("--furniture-open", help="Your word that all closed furniture was opened before the run.")
    ] = False,
    resume: Annotated[
        bool, Option("--resume", help="Walk on by itself after an outage in which the robot stopped.")
    ] = False,
    memory: MemoryLogs = None,
    rates: MoveRatesFile = None,
    dry_run: Annotated[bool, Option("--dry-run", help="Connect, check and plan; nothing moves.")] = False,
    serve: ServePort = None,
    operator: OperatorName = "",
    serial: LogSerial = True,
    certificate: Certificate = None,
    seed: Annotated[int, Option("--seed", help="Seed passed to the strategy.")] = 0,
    force: Force = False,
    json: Json = False,
) -> None:
    """Run a task on a Spot and record it; the lease is always returned.

    Keys: space or s stops the robot and ends the run, p lets it stand and g go on, k skips the container at hand, i
    says that an item is there, n marks the moment. A line tells battery, localisation, link, tags and what is next.
    Without an arm, an operator confirms by key. A robot that gets no command for three seconds stops by itself.

    Examples:

        lios spot run --robot 192.168.80.3 --site home/site.yaml --task deliver.yaml --strategy model-lios --dry-run

        lios spot run --robot 127.0.0.1:50443 --certificate spot-simulated.pem --site paper_home --own-estop
    """
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.earlier_runs import memory_now
    from recorders.sinks.mirrored import watched
    from recorders.spot.client.connection import Connection, RobotAddress, find_credentials, talking_to
    from recorders.spot.run.run import RobotRun, setup_of
    from recorders.spot.run.run_settings import RunSettings
    from recorders.spot.run.site_tasks import delivery_of, site_task
    from recorders.spot.session.session import Rates
    from recorders.spot.tags.pictures import require_detector
    from workbench.errors import BadValue, OutputExists
    from workbench.worlds.sites.site import load_site

    if output.exists() and not force and not dry_run:
        raise OutputExists(output)
    if speed is not None and not 0 < speed <= 1.6:
        raise BadValue("--speed", speed, "more than 0 and at most 1.6 m/s, Spot's own limit")
    check_within("--look", look, 0.1, 600)
    check_within("--images-hz", images_hz, 0, 60)
    place = load_site(site)
    require_detector(place)
    address = RobotAddress.read(robot)
    wanted = RobotRun(
        site=place,
        task=site_task(task or delivery_of(place), place),
        strategy=strategy,
        estimator=estimator,
        seed=seed,
        settings=RunSettings(speed_mps=speed, look_s=look, furniture_open=furniture_open, resume=resume),
        rates=Rates(images_hz=images_hz, cameras=camera_names(cameras)),
        take_lease=take_lease,
        own_estop=own_estop,
        map_folder=map_folder,
        operator_name=operator,
        log_serial=serial,
        memory=memory_now(memory, rates, place.plan),
    )
    ready = setup_of(wanted)
    with talking_to(address), Connection(address, find_credentials(), certificate=certificate) as connection:
        if dry_run:
            print_plan(connection, wanted, ready)
            return
        with watched(output.name, serve) as audience:
            watched_run = replace(wanted, audience=audience)
            report = run_by_keys(connection, watched_run, ready, output, force=force)
    print_report(report, output, as_json=json)


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
    from recorders.spot.run.run import run_and_record
    from recorders.spot.run.status_line import status_line
    from recorders.spot.run.wishes import RUN_KEYS
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
            hear=lambda e: say(event_line(e)),
        )


def print_report(report: RunReport, output: Path, *, as_json: bool) -> None:
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


def _check_parts(keep_last: float | None, split_mb: float | None, split_s: float | None) -> None:
    from workbench.errors import BadValue

    if keep_last is not None and (split_mb is not None or split_s is not None):
        raise BadValue(
            "--keep-last", keep_last, "given without --split-mb and --split-s: it writes moments, not parts"
        )


def check_within(option: str, value: float, least: float, most: float) -> None:
    from workbench.errors import BadValue

    if not least <= value <= most:
        raise BadValue(option, value, f"between {least:g} and {most:g}")


def camera_names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())
