"""A command whose output nobody reads, or that was started without streams, ends quietly with the right exit code."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from console_blocks import ROOT, environment

from workbench.files import cache_folder

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


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("command", ["log cat LOG", "houses stats", "plan LOG --pddl"])
def test_a_reader_that_has_seen_enough(command: str) -> None:
    done = _bash(f"LIOS {command} | true; exit ${{PIPESTATUS[0]}}")
    assert (done.returncode, done.stdout) == (0, "")
    assert "Broken" not in done.stderr
    assert "Exception" not in done.stderr


def test_words_that_nobody_reads_do_not_change_the_exit_code() -> None:
    assert _bash("LIOS info nowhere.mcap 2>&1 | true; exit ${PIPESTATUS[0]}").returncode == 2


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("command", ["info LOG", "info LOG --json"])
def test_no_standard_output(command: str) -> None:
    done = _bash(f"LIOS {command} >&-")
    assert (done.returncode, done.stderr) == (0, "")


def test_no_standard_error() -> None:
    assert _bash("LIOS info nowhere.mcap 2>&-").returncode == 2


@pytest.mark.ci_but(2)
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("buffered", ["PYTHONUNBUFFERED=", "PYTHONUNBUFFERED=1"])
@pytest.mark.parametrize("command", ["info LOG", "info LOG --json", "log cat LOG"])
def test_a_full_disk(command: str, buffered: str) -> None:
    done = _bash(f"{buffered} LIOS {command} > /dev/full")
    assert done.returncode == 1
    assert done.stderr.startswith("lios: No space left")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("command", ["view LOG --port 0"])
def test_what_is_stopped_by_ctrl_c_as_it_says_has_not_failed(command: str, tmp_path: Path) -> None:
    said = tmp_path / "said"
    with said.open("w", encoding="utf-8") as out:
        lios = str(Path(sys.executable).parent / "lios")
        words = [lios, *command.replace("LOG", str(LOG)).split()]
        server = subprocess.Popen(words, env=environment(), stdout=out, stderr=out, start_new_session=True)
    until = time.monotonic() + 120
    while "http://" not in said.read_text(encoding="utf-8") and time.monotonic() < until and server.poll() is None:
        time.sleep(0.1)
    server.send_signal(signal.SIGINT)
    assert server.wait(timeout=60) == 0, said.read_text(encoding="utf-8")
    assert "Traceback" not in said.read_text(encoding="utf-8")


def test_no_cache_means_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", "off")
    assert cache_folder() is None
    done = subprocess.run(
        [str(Path(sys.executable).parent / "lios"), "list", str(LOG)],
        cwd=tmp_path,
        capture_output=True,
        check=True,
    )
    assert done.stdout
    assert list(tmp_path.iterdir()) == []
