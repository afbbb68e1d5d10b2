"""Task trials on a Dask cluster: a scheduler and two worker processes, one of which is killed midway."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from test_experiment import plain, request

from workbench.evaluation.cluster import ClusterLost
from workbench.evaluation.tasks.experiment import plan_trials, remaining_units, wanted_rows
from workbench.evaluation.tasks.workers import run_unit, run_units

pytest.importorskip("distributed")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]

CLI = [sys.executable, "-m", "distributed.cli"]


Cluster = tuple[str, list[subprocess.Popen[bytes]], subprocess.Popen[bytes]]
"""The scheduler's address, the workers, the scheduler."""


@pytest.fixture
def cluster(tmp_path: object) -> Iterator[Cluster]:
    port = 18786 + os.getpid() % 1000
    address = f"tcp://127.0.0.1:{port}"
    words = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    scheduler = subprocess.Popen([*CLI[:2], "distributed.cli.dask_scheduler", *words])
    time.sleep(3)
    command = [*CLI[:2], "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    workers = [subprocess.Popen(command) for _ in range(2)]
    yield address, workers, scheduler
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


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
