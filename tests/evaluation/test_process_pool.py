"""Worker processes end with the process that started them, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from workbench.process_pool import process_pool

PARENT = """
import os, sys, time
from workbench.process_pool import process_pool
from pathlib import Path

def work(folder):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(600)

if __name__ == "__main__":
    with process_pool(2) as pool:
        waiting = [pool.submit(work, sys.argv[1]) for _ in range(4)]
        for future in waiting:
            future.result()
"""


def test_it_works() -> None:
    with process_pool(2) as pool:
        assert list(pool.map(abs, [-3, 2])) == [3, 2]


def test_an_error_does_not_wait_for_the_rest() -> None:
    with pytest.raises(ZeroDivisionError), process_pool(1) as pool:  # noqa: PT012
        pool.submit(time.sleep, 600)
        pool.submit(abs, 1)
        raise ZeroDivisionError


@pytest.mark.ci_but(1)
@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_worker_outlives_its_parent(how: signal.Signals, tmp_path: Path) -> None:
    script, marks = tmp_path / "parent.py", tmp_path / "marks"
    script.write_text(PARENT, encoding="utf-8")
    marks.mkdir()
    parent = subprocess.Popen([sys.executable, str(script), str(marks)], stderr=subprocess.DEVNULL)
    until = time.monotonic() + 60
    while len(list(marks.iterdir())) < 2 and time.monotonic() < until:
        time.sleep(0.05)
    workers = [psutil.Process(int(mark.name)) for mark in marks.iterdir()]
    assert len(workers) == 2
    parent.send_signal(how)
    _, alive = psutil.wait_procs(workers, timeout=30)
    parent.wait(timeout=30)
    assert alive == []
