"""A command whose output nobody reads, or that was started without streams, ends quietly and with the right code."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from console_blocks import ROOT, environment

LOG = ROOT / "logs" / "find-lios.mcap"
pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")


def _bash(line: str) -> subprocess.CompletedProcess[str]:
    lios = Path(sys.executable).parent / "lios"
    return subprocess.run(
        ["bash", "-c", line.replace("LIOS", str(lios)).replace("LOG", str(LOG))],
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("command", ["log cat LOG", "houses stats", "plan LOG --pddl"])
def test_a_reader_that_has_seen_enough(command: str) -> None:
    done = _bash(f"LIOS {command} | true; exit ${{PIPESTATUS[0]}}")
    assert (done.returncode, done.stdout) == (0, "")
    assert "Broken" not in done.stderr
    assert "Exception" not in done.stderr


@pytest.mark.parametrize("command", ["info LOG", "info LOG --json"])
def test_no_standard_output(command: str) -> None:
    done = _bash(f"LIOS {command} >&-")
    assert (done.returncode, done.stderr) == (0, "")


def test_no_standard_error() -> None:
    assert _bash("LIOS info nowhere.mcap 2>&-").returncode == 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk() -> None:
    done = _bash("LIOS info LOG > /dev/full")
    assert done.returncode == 1
    assert done.stderr.startswith("lios: No space left")
    assert len(done.stderr.splitlines()) == 1
