"""Logins and robots of other software: each trouble is one line and exit code 2."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bosdyn.api.graph_nav import map_pb2
from bosdyn.api.graph_nav.graph_nav_pb2 import DownloadGraphRequest
from bosdyn.client.exceptions import UnauthenticatedError, UnimplementedError
from spot_help import placed, robot, run_of

from recorders.spot.client.connection import Connection, Credentials, RobotAddress
from recorders.spot.client.control import Control
from recorders.spot.client.errors import BadLogin, LockedOut, RunStopped
from recorders.spot.client.map_upload import _time_for
from recorders.spot.client.services import MOTION, SENSES
from recorders.spot.client.software import SoftwareVersion
from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.run import run_and_record
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


@pytest.fixture(scope="module")
def there(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[str]]:
    """A simulated robot, and the options that lead to it."""
    with SimulatedSpot(*placed(), clock=RunningClock(speed_up=30)) as spot:
        yield spot.options(spot.write_certificate(tmp_path_factory.mktemp("robot") / "robot.pem"))


@pytest.fixture
def _logged_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "user")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "simulated")


@pytest.mark.ci_but(3)
@pytest.mark.usefixtures("_logged_in")
@pytest.mark.parametrize("missing", ["time-sync", "image", *SENSES, *MOTION, "manipulation"])
def test_a_robot_without_a_service_is_told_in_one_line_before_anything_moves(
    missing: str,
    there: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.delitem(SERVICES, missing)
    log = tmp_path / "run.mcap"
    options = ["--strategy", "pes-greedy", "--estimator", "counts", "-o", str(log), "--own-estop"]
    assert run(["spot", "run", *there, *options]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("lios:")]
    assert len(said) == 1
    assert f"the robot has no service {missing}. Its software is" in said[0]
    assert not log.exists()
    assert run(["spot", "check", *there]) == (2 if missing == "time-sync" else 1)
    told = capsys.readouterr()
    assert missing in (told.err if missing == "time-sync" else told.out)


@pytest.mark.usefixtures("_logged_in")
def test_a_recording_without_pictures_is_refused_by_the_service_and_goes_on_without_other_services(
    there: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(SERVICES, "image")
    assert run(["spot", "record", *there, "-o", str(tmp_path / "a.mcap"), "--for", "0.3"]) == 2
    assert "no service image" in capsys.readouterr().err
    monkeypatch.delitem(SERVICES, "local-grid-service")
    options = ["-o", str(tmp_path / "b.mcap"), "--for", "0.5", "--images-hz", "0"]
    assert run(["spot", "record", *there, *options]) == 0
    assert "NO grid (the robot has no such service)" in capsys.readouterr().err


@pytest.mark.usefixtures("_logged_in")
@pytest.mark.parametrize("software", ["3.0.0", "3.3.2", "4.0.0", "4.1.1", "5.0.0"])
def test_a_robot_of_older_software_is_checked_and_nothing_but_the_answer_is_printed(
    software: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    release = SoftwareVersion.read("--software", software)
    with SimulatedSpot(*placed(), clock=RunningClock(speed_up=30), software=release) as spot:
        where = spot.options(spot.write_certificate(tmp_path / "robot.pem"))
        assert run(["spot", "check", *where, "--own-estop", "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    found = {finding["subject"]: finding["text"] for finding in answer["findings"]}
    assert found["software"].startswith(f"robot {software}")
    assert "waypoints" in found["map"]


@pytest.mark.ci
def test_a_robot_of_software_3_runs_the_task_without_a_call_that_it_does_not_know(tmp_path: Path) -> None:
    with robot(software="3.0.0") as (spot, connection):
        report = run_and_record(connection, run_of(spot, "pes-greedy"), tmp_path / "run.mcap")
        graph = connection.client("graph-nav-service")
        assert report.ended.status == "done"
        with pytest.raises(UnimplementedError):
            graph.call(graph._stub.DownloadGraphStreaming, DownloadGraphRequest())
        sources = connection.client("image").list_image_sources()
        assert not any(source.pixel_formats for source in sources)


@pytest.mark.ci
def test_expired_tokens_are_replaced_during_a_run(tmp_path: Path) -> None:
    with robot("expired-tokens@20") as (spot, connection):
        before = connection.robot.user_token
        report = run_and_record(connection, run_of(spot, "pes-greedy"), tmp_path / "run.mcap")
        assert (report.ended.status, report.lease_returned) == ("done", True)
        assert connection.robot.user_token != before
        assert before not in spot._auth.tokens


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
