"""Logins and robots of other software: each trouble is one line and exit code 2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bosdyn.api.graph_nav import map_pb2
from bosdyn.client.exceptions import UnauthenticatedError
from spot_help import placed, robot

from recorders.spot.client.connection import Connection, Credentials, RobotAddress
from recorders.spot.client.control import Control
from recorders.spot.client.errors import BadLogin, LockedOut, RunStopped
from recorders.spot.client.map_upload import _time_for
from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.session.session import Rates, Session
from recorders.spot.simulated.basic_services import LOCKED_AFTER, SERVICES
from recorders.spot.simulated.services.server import SimulatedSpot
from workbench.cli import run


class NoSink:
    def write(self, *_: Any, **__: Any) -> bool:
        return True


def test_wrong_passwords_lock_the_user_out_and_each_is_one_line(tmp_path: Path) -> None:
    with SimulatedSpot(*placed(), clock=RunningClock()) as spot:
        certificate = spot.write_certificate(tmp_path / "robot.pem")

        def log_in(password: str) -> None:
            login = Credentials(username="user", password=password)
            Connection(RobotAddress(host=spot.address, port=spot.port), login, certificate=certificate).close()

        for _ in range(LOCKED_AFTER):
            with pytest.raises(BadLogin):
                log_in("wrong")
        with pytest.raises(LockedOut, match="Wait") as caught:
            log_in("simulated")
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("missing", ["time-sync", "graph-nav-service", "estop"])
def test_a_robot_without_a_service_is_told_in_one_line(
    missing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(SERVICES, missing)
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "user")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "simulated")
    with SimulatedSpot(*placed(), clock=RunningClock(speed_up=30)) as spot:
        certificate = spot.write_certificate(tmp_path / "robot.pem")
        there = ["--robot", f"{spot.address}:{spot.port}", "--certificate", str(certificate), "--site", "paper_home"]
        options = ["--strategy", "pes-greedy", "--estimator", "counts", "-o", str(tmp_path / "run.mcap")]
        assert run(["spot", "run", *there, *options, "--own-estop"]) in (1, 2)
        said = capsys.readouterr().err
    assert "no such service" in said
    assert len([line for line in said.splitlines() if "no such service" in line]) == 1
    assert "Traceback" not in said


def test_a_session_does_not_repeat_a_refused_login_until_the_user_is_locked_out() -> None:
    with robot(clock=RunningClock()) as (spot, connection):
        connection._credentials = Credentials(username="user", password="changed since")  # type: ignore[misc]
        session = Session(connection, placed()[0], NoSink(), rates=Rates())  # type: ignore[arg-type]
        session._closing.set()
        for _ in range(10):
            session._log_in_again()
        assert spot._auth.wrong == 1


def test_a_robot_that_takes_no_token_ends_the_run() -> None:
    with robot() as (_, connection):
        settings = RunSettings(poll_s=0.5, patience_s=2.0)
        world = SpotWorld(connection=connection, control=Control(connection), site=placed()[0], settings=settings)

        def refused() -> None:
            raise UnauthenticatedError(Exception("401"))

        with pytest.raises(RunStopped, match="tokens"):
            world.call(refused)


def test_an_upload_may_take_as_long_as_its_bytes_take() -> None:
    small, large = map_pb2.WaypointSnapshot(id="a"), map_pb2.WaypointSnapshot(id="a" * 10_000_000)
    assert _time_for(small) == pytest.approx(30.0, abs=0.1)
    assert _time_for(large) == pytest.approx(130.0, abs=1.0)
