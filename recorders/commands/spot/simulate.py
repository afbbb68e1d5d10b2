"""`lios spot simulate`: a simulated Spot in a site, to which the official client connects."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

from recorders.commands.spot.options import SiteOption
from workbench.parameters import Option


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
        str,
        Option("--software", help="Its software release, 3.0.0 or later; features of later releases are missing."),
    ] = "5.0.0",
    certificate: Annotated[
        Path, Option("--certificate", help="Where to write the root certificate for clients.")
    ] = Path("spot-simulated.pem"),
    miss_rate: Annotated[
        float | None,
        Option(
            "--miss-rate",
            help="Probability that its detector misses a tag from nearby and straight ahead (more with distance and "
            "angle; fixed for each viewpoint by the seed); default: 0.",
        ),
    ] = None,
    seed: Annotated[int, Option("--seed", help="Seed of the sensors' noise and of missed tags.")] = 0,
    for_s: Annotated[float | None, Option("--for", help="Stop after this many seconds.")] = None,
) -> None:
    """Simulate a Spot in a site; the official client connects to it as to a real robot.

    User "user", password "simulated"; loopback only. Ctrl-C ends it.

    Examples:

        lios spot simulate --site paper_home --configuration A

        lios spot simulate --fault stuck@30+10 --fault dropped@60+3

        lios spot simulate --miss-rate 0.2
    """
    import time

    from recorders.spot.client.errors import require_bosdyn

    require_bosdyn()
    from recorders.spot.client.software import SoftwareVersion
    from recorders.spot.client.time_source import RunningClock
    from recorders.spot.simulated.faults import read_faults
    from recorders.spot.simulated.missed_tags import MissedTags
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
    missed = None if miss_rate is None else MissedTags(rate=miss_rate, seed=seed)
    with SimulatedSpot(
        place, house, clock=RunningClock(speed_up=speed_up), port=port, faults=faults, seed=seed, software=release
    ) as robot:
        with robot.state.alive() as state:
            state.missed_tags = missed
        robot.write_certificate(certificate)
        try:
            say(f"A simulated Spot in {place.name}, configuration {configuration}, at {robot.address}:{robot.port}")
            say(f"Certificate: {certificate}. User: {robot.username}, password: {robot.password}. Ctrl-C ends it.")
            say(f"Next: lios spot run {shlex.join(robot.options(certificate, site))}")
            ends = None if for_s is None else time.monotonic() + for_s
            while ends is None or time.monotonic() < ends:
                time.sleep(0.1)
        except KeyboardInterrupt:
            say("Stopped.")  # requested by the user: not a failure
