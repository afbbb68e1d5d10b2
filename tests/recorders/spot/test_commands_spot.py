"""The Spot commands: what they print, how they fail, what they leave behind."""

from __future__ import annotations

import builtins
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from spot_help import messages, placed

from recorders.spot.client.time_source import RunningClock
from recorders.spot.simulated.services.server import SimulatedSpot
from replayers.runs.run import read
from workbench.cli import run


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[SimulatedSpot, list[str]]]:
    """A simulated robot in real time, its body fast, and the options that lead to it."""
    site, house = placed()
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "user")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "simulated")
    with SimulatedSpot(site, house, clock=RunningClock(speed_up=30)) as spot:
        yield spot, spot.options(spot.write_certificate(tmp_path / "robot.pem"))


def test_site_check(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["site", "check", "paper_home", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["containers"], answer["reachable"], answer["errors"]) == (9, 9, 0)
    assert {"Fridge", "Sofa"} <= set(answer["container_types"])
    assert run(["site", "check", "paper_hom"]) == 2
    assert "paper_home" in capsys.readouterr().err
    (tmp_path / "site.yaml").write_text(
        "lios_site: 1\nname: x\nstart: {x_m: 0, y_m: 0}\n"
        "rooms: [{id: r, kind: Kitchen, floor: [[0, 0], [4, 0], [4, 4]]}]\ncontainers: []\n"
        "travel: {locations: [start], metres: [[0]]}\n"
    )
    assert run(["site", "check", str(tmp_path)]) == 1
    said = capsys.readouterr().out
    assert "containers" in said
    assert said.startswith("x: 1 room, 0 containers, 0 tags; ")


@pytest.mark.ci
def test_spot_run_and_what_can_be_done_with_its_log(
    robot: tuple[SimulatedSpot, list[str]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spot, there = robot
    log = tmp_path / "run.mcap"
    options = ["--estimator", "counts", "--look", "0.3", "--images-hz", "1", "-o", str(log)]
    free = ["--own-estop", "--furniture-open", "--stop-within", "2"]
    assert run(["spot", "run", *there, *options, *free, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == "done"
    assert answer["lease_returned"]
    assert spot.state.leases.owner is None
    assert read(log).complete
    assert run(["spot", "run", *there, *options]) == 2, "the log is there already"
    assert "--force" in capsys.readouterr().err


def test_a_dry_run_prints_the_first_plan_and_takes_no_lease(
    robot: tuple[SimulatedSpot, list[str]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spot, there = robot
    assert run(["spot", "run", *there, "--estimator", "counts", "--dry-run"]) == 0
    assert "Plan 1 (start)" in capsys.readouterr().err
    assert spot.state.leases.number == 0


def test_a_missing_emergency_stop_is_a_line_and_no_traceback(
    robot: tuple[SimulatedSpot, list[str]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, there = robot
    assert run(["spot", "run", *there, "--estimator", "counts", "-o", str(tmp_path / "run.mcap")]) == 1
    err = capsys.readouterr().err
    assert "no e-stop endpoint guards the robot" in err
    assert "Traceback" not in err


def test_spot_record(
    robot: tuple[SimulatedSpot, list[str]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, there = robot
    log = tmp_path / "s.mcap"
    assert run(["spot", "record", *there, "-o", str(log), "--for", "1", "--images-hz", "5", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["dropped"] == {}
    assert answer["taken"]["images"] >= 4
    assert messages(log, "/camera/frontleft_fisheye")


def test_bad_usage_is_said_in_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for arguments, said in (
        (["spot", "run", "--robot", "127.0.0.1:1:2:x", "--site", "paper_home"], "HOST or HOST:PORT"),
        (["spot", "run", "--robot", "127.0.0.1:9", "--site", "nowhere.yaml"], "no such file"),
        (["spot", "run", "--robot", "127.0.0.1:9", "--site", "paper_home", "--speed", "9"], "1.6 m/s"),
        (
            ["spot", "run", "--robot", "127.0.0.1:9", "--site", "paper_home", "--speed", "1.5"],
            "at least 1.00 m at 1.5 m/s",
        ),
        (["spot", "run", "--robot", "127.0.0.1:9", "--site", "paper_home", "--strategy", "nope"], "model-lios"),
        (["spot", "simulate", "--fault", "bored@3"], "lost-lease"),
        (["spot", "simulate", "--configuration", "Z"], "A, B, C, D"),
        (["spot", "simulate", "--speed-up", "0"], "--speed-up"),
        (["evaluate", "spot", "--configurations", "Z"], "A, B, C, D"),
        (["import", str(tmp_path / "x.bag"), "--site", "paper_home"], "no such file"),
        (["site", "from-log", str(tmp_path / "x.mcap")], "no such file"),
    ):
        assert run([*arguments]) == 2, arguments
        err = capsys.readouterr().err
        assert said in err, err
        assert len(err.strip().splitlines()) == 1, err


def test_simulate_writes_its_certificate_and_ends_by_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    certificate = tmp_path / "c.pem"
    assert run(["spot", "simulate", "--port", "0", "--certificate", str(certificate), "--for", "0.2"]) == 0
    assert certificate.read_text().startswith("-----BEGIN CERTIFICATE-----")
    assert "lios spot run --robot 127.0.0.1:" in capsys.readouterr().err


def test_without_the_sdk_the_extra_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = builtins.__import__

    def without(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("bosdyn"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    assert run(["evaluate", "spot"]) == 2
    assert "pip install 'lios-workbench[spot]'" in capsys.readouterr().err
