"""`lios spot record`: records a session of a Spot that somebody drives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from recorders.commands.spot.options import (
    FRONT_CAMERAS,
    IMAGES_HZ,
    Cameras,
    Certificate,
    ImagesHz,
    LogSerial,
    OperatorName,
    Robot,
    camera_names,
    check_within,
)
from workbench.options import Force, Json, ServePort
from workbench.parameters import Option


def record(
    robot: Robot,
    site: Annotated[str, Option("--site", help="Survey file or shipped site; omit it if there is none yet.")] = "",
    output: Annotated[Path, Option("--output", "-o", help="The MCAP file to write.")] = Path("session.mcap"),
    images_hz: ImagesHz = IMAGES_HZ,
    cameras: Cameras = FRONT_CAMERAS,
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
        Option("--keep-last", help="Keep only the last seconds, in memory; key w writes them, and so does the end."),
    ] = None,
    furniture_open: Annotated[
        bool, Option("--furniture-open", help="Assert that all closed furniture was opened before the session.")
    ] = False,
    serve: ServePort = None,
    operator: OperatorName = "",
    serial: LogSerial = True,
    certificate: Certificate = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Record a Spot session: state, odometry, localisation, tags, pictures, local grid, faults, battery.

    Takes no lease and never delays the robot. Keys: n opens a line for a note, m marks the moment, o says that the
    container at hand was opened (otherwise a closed container in which nothing is seen is not logged); d ends the
    session as done, f as failed, q and Ctrl-C according to whether the goal is met. User name and password come from
    BOSDYN_CLIENT_USERNAME and BOSDYN_CLIENT_PASSWORD or a prompt.

    Examples:

        lios spot record --robot 192.168.80.3 --site home/site.yaml -o trial.mcap

        lios spot record --robot 127.0.0.1:50443 --certificate spot-simulated.pem --site paper_home --for 60

        lios spot record --robot 192.168.80.3 -o round.mcap && lios site from-log round.mcap -o home
    """
    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.sinks.files import SplitLimits
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
        split=SplitLimits(part_bytes=None if split_mb is None else round(split_mb * 1e6), part_s=split_s),
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


def _check_parts(keep_last: float | None, split_mb: float | None, split_s: float | None) -> None:
    from workbench.errors import BadValue

    if keep_last is not None and (split_mb is not None or split_s is not None):
        raise BadValue(
            "--keep-last", keep_last, "given without --split-mb and --split-s: it writes moments, not parts"
        )
