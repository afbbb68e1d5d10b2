"""What ends a run in time: a low battery and a full disk; and the dock at its start and end."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from bosdyn.api.graph_nav import nav_pb2
from spot_help import is_free, placed, robot, run_of

from recorders.mcap_io import writer
from recorders.mcap_io.writer import DiskFull
from recorders.spot.client.control import Control
from recorders.spot.client.docking import docked_at
from recorders.spot.client.errors import NotReady, RunStopped
from recorders.spot.client.time_source import RunningClock
from recorders.spot.record_session import SessionPlan, record_session
from recorders.spot.run.run import run_and_record
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.session.session import Rates
from workbench.worlds.house import LocationId
from workbench.worlds.sites.site import Site


def _with_dock() -> Site:
    site, _ = placed()
    return replace(site, robot=replace(site.robot, dock=520))


def test_a_run_does_not_begin_on_a_low_battery(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        spot.state.body.battery = 0.25
        with pytest.raises(NotReady, match="25 %"):
            run_and_record(connection, run_of(spot), tmp_path / "run.mcap")
        assert is_free(spot)


def test_a_battery_that_runs_low_on_the_way_ends_the_run() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        world = SpotWorld(connection=connection, control=control, site=placed()[0], settings=RunSettings(poll_s=0.5))
        world.check_battery()
        spot.state.body.battery = 0.1
        with pytest.raises(RunStopped, match=r"battery is at 10 %"):
            world.go_to(LocationId("fridge"))


def test_a_docked_robot_is_undocked_only_where_the_site_names_the_dock() -> None:
    with robot() as (spot, connection):
        spot.state.dock = 520
        with pytest.raises(NotReady, match="undock"), Control(connection, own_estop=True):
            pass
        with Control(connection, own_estop=True, dock=520):
            assert docked_at(connection) is None
            assert spot.state.body.standing


@pytest.mark.slow
def test_a_run_ends_on_its_dock(tmp_path: Path) -> None:
    with robot(site=_with_dock()) as (spot, connection):
        spot.state.dock = 520
        report = run_and_record(connection, run_of(spot, "pes-greedy"), tmp_path / "run.mcap")
        assert report.ended.status == "done"
        assert spot.state.dock == 520
        assert is_free(spot)


class FullDisk:
    """A file on a disk that has room for so many bytes."""

    def __init__(self, inner: Any, room: int) -> None:
        self._inner, self._room = inner, room

    def write(self, data: bytes) -> int:
        self._room -= len(data)
        if self._room < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return int(self._inner.write(data))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    real = writer.create
    monkeypatch.setattr(writer, "create", lambda path, **how: FullDisk(real(path, **how), 40_000))


@pytest.mark.slow
def test_a_full_disk_stops_the_robot_on_its_way_and_says_so(
    full_disk: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heard: list[Any] = []
    with robot(clock=RunningClock()) as (spot, connection):
        run = replace(run_of(spot, "pes-greedy", poll_s=0.1), rates=Rates(images_hz=10.0))
        with pytest.raises(DiskFull, match="No space left"):
            run_and_record(connection, run, tmp_path / "run.mcap", on_event=heard.append)
        assert spot.state.body.walk is not None
        assert spot.state.body.walk.state != "arrived", "not at the end of the walk only"
        assert not spot.state.body.standing
        assert is_free(spot)
    assert heard[-1].status == "aborted"
    assert heard[-1].reason.startswith("recording stopped")
    assert "No space left" in capsys.readouterr().err


def test_a_full_disk_ends_a_session(full_disk: None, tmp_path: Path) -> None:
    with robot(clock=RunningClock()) as (_, connection):
        plan = SessionPlan(site=placed()[0], rates=Rates(images_hz=10.0), for_s=20.0)
        with pytest.raises(DiskFull, match="No space left"):
            record_session(connection, plan, tmp_path / "s.mcap")
