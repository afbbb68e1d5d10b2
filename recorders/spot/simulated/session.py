"""A simulated robot with a client connected to it, for experiments and tests in one process."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from recorders.spot.client.connection import Connection, Credentials, RobotAddress
from recorders.spot.client.software import SoftwareVersion
from recorders.spot.client.time_source import RobotClock, SteppedClock
from recorders.spot.simulated.faults import Fault
from recorders.spot.simulated.robot import NEWEST
from recorders.spot.simulated.services.server import SimulatedSpot
from workbench.worlds.house import House
from workbench.worlds.sites.site import Site


@contextmanager
def simulated_robot(
    site: Site,
    house: House,
    *,
    clock: RobotClock | None = None,
    faults: tuple[Fault, ...] = (),
    seed: int = 0,
    password: str = "simulated",
    software: SoftwareVersion = NEWEST,
) -> Generator[tuple[SimulatedSpot, Connection]]:
    """A simulated robot and a connection to it by the official client; both are closed at the end of the block."""
    login = Credentials(username="user", password=password)
    with (
        tempfile.TemporaryDirectory(prefix="lios-spot-") as folder,
        SimulatedSpot(site, house, clock=clock, faults=faults, seed=seed, login=login, software=software) as robot,
    ):
        certificate = robot.write_certificate(Path(folder) / "robot.pem")
        stepped = robot.clock if isinstance(robot.clock, SteppedClock) else None
        with Connection(
            RobotAddress(host=robot.address, port=robot.port),
            login,
            certificate=certificate,
            stepped=stepped,
        ) as connection:
            yield robot, connection
