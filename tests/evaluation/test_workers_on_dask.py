"""Task trials on a Dask cluster: a scheduler and two worker processes, one of which is killed midway."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from test_experiment import plain, request

from workbench.cli import run
from workbench.evaluation.cluster import ClusterLost
from workbench.evaluation.tasks.experiment import plan_trials, remaining_units, wanted_rows
from workbench.evaluation.tasks.workers import run_unit, run_units

Client = pytest.importorskip("distributed").Client
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]

LOG = Path(__file__).resolve().parents[2] / "logs" / "find-lios.mcap"
CLI = [sys.executable, "-m", "distributed.cli"]


Cluster = tuple[str, list[subprocess.Popen[bytes]], subprocess.Popen[bytes]]
"""The scheduler's address, the workers, the scheduler."""


@pytest.fixture
def cluster() -> Iterator[Cluster]:
    with started_cluster() as started:
        yield started


@contextmanager
def started_cluster(*, scheduler_path: str = "", worker_path: str = "") -> Generator[Cluster]:
    """A scheduler and two workers, each with folders of its own before the installed packages."""
    port = 18786 + os.getpid() % 1000
    address = f"tcp://127.0.0.1:{port}"
    words = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    scheduler = subprocess.Popen(
        [*CLI[:2], "distributed.cli.dask_scheduler", *words], env={**os.environ, "PYTHONPATH": scheduler_path}
    )
    time.sleep(3)
    command = [*CLI[:2], "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    workers = [subprocess.Popen(command, env={**os.environ, "PYTHONPATH": worker_path}) for _ in range(2)]
    try:
        yield address, workers, scheduler
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def other_release(tmp_path: Path) -> str:
    """A folder that holds another release of this package, as far as anybody can tell from its version."""
    (tmp_path / "workbench").mkdir()
    (tmp_path / "workbench" / "__init__.py").write_text('__version__ = "99.0"\n')
    metadata = tmp_path / "lios_workbench-99.0.dist-info" / "METADATA"
    metadata.parent.mkdir()
    metadata.write_text("Metadata-Version: 2.1\nName: lios-workbench\nVersion: 99.0\n")
    return str(tmp_path)


REPLAY = ["replay", str(LOG), "-s", "opt-greedy", "--worlds", "0", "--json", "--scheduler"]


def test_a_scheduler_of_another_release_runs_none_of_our_code(
    other_release: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with started_cluster(scheduler_path=other_release) as (address, _, _):
        assert run([*REPLAY, address]) == 0
    assert '"strategy": "opt-greedy"' in capsys.readouterr().out


def test_workers_of_another_release_are_one_line(other_release: str, capsys: pytest.CaptureFixture[str]) -> None:
    with started_cluster(worker_path=other_release) as (address, _, _):
        until = time.monotonic() + 60
        with Client(address) as client:
            while not client.scheduler_info()["workers"]:
                assert time.monotonic() < until
                time.sleep(0.1)
        assert run([*REPLAY, address]) == 2
    said = capsys.readouterr().err.strip()
    assert re.fullmatch(r"lios: the Dask worker \S+ has lios-workbench 99\.0, this machine .*both\.", said)


def test_a_worker_may_die(cluster: Cluster) -> None:
    address, workers, _ = cluster
    asked = request(trials=8)
    planned = plan_trials(asked)
    units = remaining_units(asked, planned.keys, [], None)
    done = []
    for some in run_units(units, workers=2, scheduler=address):
        if not done:
            workers[0].send_signal(signal.SIGKILL)
        done += some
    here = [row for unit in units for row in run_unit(unit)]
    order = [plain(row) for row in wanted_rows(asked, planned.keys, done)]
    assert order == [plain(row) for row in wanted_rows(asked, planned.keys, here)]


def test_a_lost_cluster_is_one_line(cluster: Cluster) -> None:
    address, _, scheduler = cluster
    asked = request(trials=12)
    units = remaining_units(asked, plan_trials(asked).keys, [], None)

    def run_on() -> None:
        for _ in run_units(units, workers=2, scheduler=address):
            scheduler.send_signal(signal.SIGKILL)

    with pytest.raises(ClusterLost, match="run the same command again"):
        run_on()
