"""A simulated robot for tests: the paper's home, configuration A, and logs opened again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from recorders.spot.client.connection import Connection
from recorders.spot.client.software import SoftwareVersion
from recorders.spot.client.time_source import RobotClock, SteppedClock
from recorders.spot.run.run import RobotRun
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.site_tasks import delivery_of, site_task
from recorders.spot.session.session import Rates
from recorders.spot.simulated.faults import read_faults
from recorders.spot.simulated.services.server import SimulatedSpot
from recorders.spot.simulated.session import simulated_robot
from workbench.worlds.house import House
from workbench.worlds.sites.configurations import pick_configuration, site_and_house
from workbench.worlds.sites.site import Site, load_site

FEW = Rates(state_hz=1.0, localization_hz=1.0, fiducials_hz=1.0, images_hz=0.05, grid_hz=0.05, image_ratio=0.25)
"""Enough of everything, quickly."""


@cache
def home() -> Site:
    return load_site("paper_home")


@cache
def placed(configuration: str = "A") -> tuple[Site, House]:
    return site_and_house(home(), pick_configuration(home(), configuration))


@contextmanager
def robot(
    *faults: str,
    clock: RobotClock | None = None,
    configuration: str = "A",
    site: Site | None = None,
    password: str = "simulated",
    software: str = "5.0.0",
) -> Iterator[tuple[SimulatedSpot, Connection]]:
    """A robot on stepped time unless another clock is given, and a connection to it."""
    place, house = placed(configuration)
    if site is not None:
        place, house = site, House(plan=site.plan, contents=house.contents)
    release = SoftwareVersion.read("software", software)
    with simulated_robot(
        place,
        house,
        clock=clock or SteppedClock(),
        faults=read_faults(faults),
        password=password,
        software=release,
    ) as both:
        yield both


def run_of(spot: SimulatedSpot, strategy: str = "conditioned-lios", **settings: Any) -> RobotRun:
    """A run whose commands hold for long: in real time, a busy computer must not stop the robot, and in stepped time
    each that is renewed costs calls."""
    site = spot.state.site
    return RobotRun(
        site=site,
        task=site_task(delivery_of(home()), site),
        strategy=strategy,
        estimator="counts",
        rates=FEW,
        settings=RunSettings(**{"poll_s": 0.5, "stop_within_m": 2.0, "furniture_open": True, **settings}),
        truth=spot.state.house.contents,
        own_estop=True,
    )


def is_free(spot: SimulatedSpot) -> bool:
    """Whether nobody of ours has the lease."""
    owner = spot.state.leases.owner
    return owner is None or owner.client_name == "another-client"


def messages(path: Path, topic: str | None = None) -> list[tuple[str, int, int, bytes]]:
    """(topic, log_time, publish_time, data) of a log that was closed properly."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        topics = None if topic is None else [topic]
        return [(c.topic, m.log_time, m.publish_time, m.data) for _, c, m in reader.iter_messages(topics=topics)]
