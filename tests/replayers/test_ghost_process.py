"""The process of the ghosts: it reports, ends with the run and with whoever started it, and is started again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from sample_logs import killed_toy_log, write_toy_log

from replayers.live.ghost_bounds import GhostReport
from replayers.live.ghost_process import MAX_RESTARTS, GhostProcess, report_rounds
from replayers.live.ghosts import Ghosts, ghost_log
from replayers.runs.run import read

PATIENCE_S = 120.0


def _until(found: Callable[[], object]) -> object:
    """Waits, as long as a busy machine may take, until something is there."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if (made := found()) is not None:
            return made
        time.sleep(0.05)
    raise AssertionError(f"nothing within {PATIENCE_S} s")


def _alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_rounds_go_on_through_what_cannot_be_read_yet_and_stop_at_the_end(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    said: list[GhostReport] = []

    def send(report: GhostReport) -> None:
        said.append(report)
        if "no such file" in report.note:
            write_toy_log(log)

    report_rounds(Ghosts(log, ("pes-greedy",)), send, every_s=0.0)
    assert "no such file" in said[0].note
    assert said[-1].ended == "The run has ended."
    assert [bounds.strategy for bounds in said[-1].bounds] == ["model-lios", "pes-greedy"]


@pytest.mark.slow
def test_the_process_reports_records_and_ends_with_the_run(tmp_path: Path) -> None:
    log = write_toy_log(tmp_path / "run.mcap")
    process = GhostProcess(log, ("pes-greedy",), output=tmp_path / "ghosts")
    try:

        def ended() -> GhostReport | None:
            report = process.latest()
            return report if report is not None and report.ended else None

        report = _until(ended)
        assert isinstance(report, GhostReport)
        assert report.bounds[0].exact
        assert read(ghost_log(tmp_path / "ghosts", "pes-greedy")).info.source == "replay"
        assert process.pid is None
    finally:
        process.close()


@pytest.mark.slow
def test_a_process_that_dies_is_started_again_a_few_times(tmp_path: Path) -> None:
    log = killed_toy_log(tmp_path / "run.mcap")
    process = GhostProcess(log, ("pes-greedy",), output=tmp_path / "ghosts")
    try:
        reports: list[GhostReport] = []
        for _ in range(MAX_RESTARTS + 1):
            pid = process.pid
            assert pid is not None
            os.kill(pid, signal.SIGKILL)

            def replaced(was: int = pid) -> int | None:
                report = process.latest()
                if report is not None:
                    reports.append(report)
                return 1 if process.pid != was else None

            _until(replaced)
        assert process.pid is None
        assert "are not started again" in reports[-1].ended
    finally:
        process.close()


@pytest.mark.slow
def test_it_ends_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    log = killed_toy_log(tmp_path / "run.mcap")
    code = (
        "import sys, time; from pathlib import Path; from replayers.live.ghost_process import GhostProcess\n"
        "if __name__ == '__main__':\n"
        "    made = GhostProcess(Path(sys.argv[1]), ('pes-greedy',), output=Path(sys.argv[2]))\n"
        "    print(made.pid, flush=True)\n"
        "    time.sleep(600)\n"
    )
    script = tmp_path / "parent.py"
    script.write_text(code, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script), str(log), str(tmp_path / "ghosts")], stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
        parent.wait()
    try:
        _until(lambda: None if _alive(pid) else 1)
    finally:
        with suppress(OSError):
            os.kill(pid, signal.SIGKILL)
