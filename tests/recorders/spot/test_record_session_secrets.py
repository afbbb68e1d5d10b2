"""Credentials are in no log: every byte of recorded runs and sessions is searched, compressed and decompressed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader
from spot_help import placed

from recorders.spot.client.connection import Credentials
from recorders.spot.client.time_source import RunningClock
from recorders.spot.simulated.services.server import SimulatedSpot
from workbench.cli import run

USER, PASSWORD = "ada.lovelace-7", "open-sesame-42"


def everything(path: Path) -> Iterator[bytes]:
    """The file as it is, and all that is packed in it."""
    yield path.read_bytes()
    with path.open("rb") as stream:
        reader = make_reader(stream)
        for schema, channel, message in reader.iter_messages():
            yield message.data
            yield repr((schema, channel)).encode()
        for attachment in reader.iter_attachments():
            yield attachment.name.encode() + attachment.data
        for metadata in reader.iter_metadata():
            yield repr(metadata).encode()


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("command", ["record", "run"])
def test_nothing_of_a_login_is_in_a_log(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    site, house = placed()
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", USER)
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", PASSWORD)
    log = tmp_path / "log.mcap"
    clock = RunningClock(speed_up=30)
    with SimulatedSpot(site, house, clock=clock, login=Credentials(username=USER, password=PASSWORD)) as spot:
        there = spot.options(spot.write_certificate(tmp_path / "robot.pem"))
        how = {
            "record": ["--for", "1.5", "--state-hz", "20"],
            "run": ["--estimator", "counts", "--look", "0.3", "--own-estop"],
        }[command]
        assert run(["spot", command, *there, "-o", str(log), *how]) == 0
        tokens = [token.encode() for token in spot._auth.tokens]
    assert tokens
    secrets = [PASSWORD.encode(), USER.encode(), *tokens]
    said = "".join(capfd.readouterr()).encode()
    pieces = [*everything(log), said]
    assert len(pieces) > 100
    assert not any(secret in piece for secret in secrets for piece in pieces)
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and PASSWORD.encode() in path.read_bytes()]
