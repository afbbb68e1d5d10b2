"""The strategies over one log, shared among processes: the same outcomes, in the same order."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from toy import FRIDGE
from toy_logs import simulated_log

from replayers.batch.replay_all import LogFailed, ReplayRequest, replay_all
from replayers.batch.store import StoredReplay
from replayers.batch.work_split import FAMILIES, WorkPackage, work_packages
from replayers.counterfactual.prepared_log import ReplaySettings
from workbench.planning.strategies import VARIANTS, strategy_names
from workbench.process_pool import can_inherit

A, B = Path("a.mcap"), Path("b.mcap")

IN_PROCESSES = """
import sys
from pathlib import Path
import msgspec
import replayers.batch.replay_all as batch
from replayers.counterfactual.prepared_log import ReplaySettings
from workbench.plugins import NameOrigin
from workbench.process_pool import can_inherit

batch.MIN_OPEN_FOR_WORKERS = 0
logs, output, workers = [Path(log) for log in sys.argv[4:]], Path(sys.argv[1]), int(sys.argv[2])
names = tuple(sys.argv[3].split(","))
settings = ReplaySettings(worlds=50)
wanted = batch.ReplayRequest(strategies=names, settings=settings, output=output, origin=NameOrigin.USER)
assert can_inherit()
made = list(batch.replay_all(logs, wanted, workers=workers))
print(msgspec.json.encode(made).decode())
"""

TAKES_LONG = """
import sys, time
from pathlib import Path
import replayers.batch.log_replayer
import replayers.batch.replay_all as batch
from replayers.counterfactual.prepared_log import ReplaySettings

def replay_on(prepared, name, origin, worlds):
    import os
    (Path(sys.argv[2]) / str(os.getpid())).touch()
    time.sleep(600)

replayers.batch.log_replayer.replay_on, batch.MIN_OPEN_FOR_WORKERS = replay_on, 0
wanted = batch.ReplayRequest(strategies=("opt-greedy", "opt-lios"), settings=ReplaySettings())
list(batch.replay_all([Path(sys.argv[1])], wanted, workers=2))
"""


def test_strategies_that_share_what_is_remembered_stay_together_and_the_costly_go_first() -> None:
    names = ("lios", "pes-greedy", "mine:Planner", "scout-lios", "greedy", "opt-lios@everywhere")
    assert work_packages({A: names, B: ("opt-greedy",)}) == (
        WorkPackage(log=A, strategies=("mine:Planner",)),
        WorkPackage(log=A, strategies=("scout-lios",)),
        WorkPackage(log=A, strategies=("pes-greedy", "greedy")),
        WorkPackage(log=B, strategies=("opt-greedy",)),
        WorkPackage(log=A, strategies=("opt-lios@everywhere",)),
        WorkPackage(log=A, strategies=("lios",)),
    )
    assert work_packages({A: ()}) == ()


def test_families_name_strategies_that_there_are() -> None:
    members = [name for family in FAMILIES for name in family]
    assert len(members) == len(set(members))
    assert set(members) <= {*strategy_names(with_truth=False), *VARIANTS}


@pytest.mark.ci
@pytest.mark.skipif(sys.platform != "linux", reason="processes are copies on Linux only")
@pytest.mark.parametrize(
    "names",
    [
        "opt-greedy,oracle,model-lios",
        pytest.param("scout-lios,opt-greedy,oracle,misbehaving:Raises,pes-greedy,model-lios", marks=pytest.mark.slow),
    ],
)
def test_several_processes_say_what_one_says(names: str, tmp_path: Path) -> None:
    logs = [str(simulated_log(tmp_path / "a.mcap")), str(tmp_path / "torn.mcap")]
    logs.append(str(simulated_log(tmp_path / "b.mcap", known=(FRIDGE,), run_id="123456789abc")))
    (tmp_path / "torn.mcap").write_bytes(b"no log")
    one, three = (_outcomes(tmp_path / f"with {n}", n, names, logs) for n in (1, 4))
    assert one == three
    kept = [sorted(p.name for p in (tmp_path / f"with {n}").rglob("*.json")) for n in (1, 4)]
    assert kept[0] == kept[1] != []
    assert _outcomes(tmp_path / "with 4", 4, names, logs) == one  # resumed


def _outcomes(output: Path, workers: int, names: str, logs: list[str]) -> list[dict[str, object]]:
    code = [sys.executable, "-c", IN_PROCESSES, str(output), str(workers), names, *logs]
    here = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(code, capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": here})
    return json.loads(done.stdout)


@pytest.mark.ci_but(1)
@pytest.mark.skipif(sys.platform != "linux", reason="processes are copies on Linux only")
@pytest.mark.parametrize("how", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow), signal.SIGKILL])
def test_what_is_stopped_stops_in_every_process(how: signal.Signals, tmp_path: Path) -> None:
    log, marks = simulated_log(tmp_path / "run.mcap"), tmp_path / "marks"
    marks.mkdir()
    code = [sys.executable, "-c", TAKES_LONG, str(log), str(marks)]
    parent = subprocess.Popen(code, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 60
    while len(list(marks.iterdir())) < 2 and time.monotonic() < until:
        time.sleep(0.05)
    workers = [psutil.Process(int(mark.name)) for mark in marks.iterdir()]
    assert len(workers) == 2
    assert parent.pid not in {worker.pid for worker in workers}
    parent.send_signal(how)
    _, alive = psutil.wait_procs(workers, timeout=30)
    parent.wait(timeout=30)
    assert alive == []


def test_beside_another_thread_no_process_is_copied(tmp_path: Path) -> None:
    import threading

    leave = threading.Event()
    other = threading.Thread(target=leave.wait)
    other.start()
    try:
        assert not can_inherit()
        log = simulated_log(tmp_path / "run.mcap")
        wanted = ReplayRequest(strategies=("opt-greedy", "oracle"), settings=ReplaySettings(worlds=0))
        made = list(replay_all([log], wanted, workers=2))
    finally:
        leave.set()
        other.join()
    assert [type(outcome) for outcome in made] == [StoredReplay, LogFailed]
