"""Start-up: a command imports only the libraries that it uses, since imports would dominate its run time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workbench.third_party.loaded_kernels import is_tried

ROOT = Path(__file__).resolve().parents[1]
LOG = "logs/find-greedy.mcap"

NUMBERS = {"numpy", "numba", "scipy", "pandas", "pyarrow"}
SCIPY = {"scipy.optimize", "scipy.cluster", "scipy.spatial", "scipy.ndimage", "scipy.sparse"}
"""Numba itself loads scipy.linalg where it compiles."""
PICTURES = {"matplotlib", "viser", "PIL", "skimage", "shapely"}
TORCH = {"torch", "sentence_transformers"}
TABLES = {"rich", "rich.console", "rich.table"}
NETWORK = {"ssl", "http.client", "urllib.request"}

UNUSED_BY_A_REPLAY = {
    "concurrent.futures.process",
    "recorders.mcap_io.writer",
    "recorders.sinks.files",
    "replayers.batch.compare",
    "replayers.batch.next_look",
    "replayers.log_tools.copy_log",
    "replayers.log_tools.info",
    "replayers.memory.collect",
    "workbench.beliefs.asking.chat_client",
    "workbench.beliefs.best",
    "workbench.beliefs.fcnn",
    "workbench.beliefs.people.people",
    "workbench.evaluation.cluster",
    "workbench.evaluation.statistics",
    "workbench.process_pool",
}
"""Of the workbench itself, in one process, over a whole log, with one strategy and the estimator counts."""

RUN = "import sys; from workbench.cli import run; run(sys.argv[1:]); "
TELL = "print(*sorted(sys.modules), sep='\\n', file=sys.stderr)"


@pytest.mark.ci_but(2)
@pytest.mark.parametrize(
    ("command", "spared"),
    [
        ("--help", NUMBERS | PICTURES | TORCH | TABLES | NETWORK | {"workbench.worlds.house"}),
        ("list logs", NUMBERS - {"numpy"} | PICTURES | TORCH),
        ("list logs --strategy lios", NUMBERS - {"numpy"} | PICTURES | TORCH),
        (f"info {LOG}", NUMBERS | PICTURES | TORCH),
        ("compare tests", NUMBERS - {"numpy"} | PICTURES | TORCH),
        (f"plan {LOG}", SCIPY | PICTURES | TORCH | {"pandas", "pyarrow"}),
        (f"replay {LOG} -s opt-greedy --workers 1", SCIPY | PICTURES | TORCH | {"pandas", "pyarrow"}),
        (f"replay {LOG} -s opt-greedy --workers 1 --json", TABLES | NETWORK | UNUSED_BY_A_REPLAY),
    ],
    ids=lambda value: value.split()[0] if isinstance(value, str) else "",
)
def test_a_command_loads_nothing_big_that_it_does_not_use(command: str, spared: set[str]) -> None:
    assert not spared & _loaded(RUN + TELL, *command.split())


@pytest.mark.skipif(not is_tried(), reason="numba loads its functions itself")
def test_what_is_compiled_already_is_loaded_without_the_compiler() -> None:
    """What numba prepares in order to compile, scipy.linalg among it, takes a quarter of a replay's start."""
    command = ("replay", "logs/deliver-3.mcap", "-s", "opt-lios,scout-lios", "--workers", "1", "--json")
    _loaded(RUN, *command)
    spared = {"scipy.linalg", "numba.np.arraymath", "numba.np.npyfuncs", "numba.typed.typeddict"}
    spared |= {"numba.np.arrayobj", "numba.cpython.unicode", "numpy.ma"}
    assert not spared & _loaded(RUN + TELL, *command)


SHORT_REPLAY = ("replay", LOG, "-s", "opt-lios", "--workers", "1", "--json")


def test_garbage_is_not_looked_for_in_a_short_replay() -> None:
    """What modules make stays; looking through it, and once more at the end, takes a tenth of a short replay."""
    _loaded(RUN, *SHORT_REPLAY)
    runs = "sum(each['collections'] for each in gc.get_stats())"
    told = _told_at_the_end(f"print({runs} - before, gc.get_freeze_count() > 10_000)", *SHORT_REPLAY, before=runs)
    assert told == ["0", "True"]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are counted in /proc")
def test_numpy_starts_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    count = "print(len(os.listdir('/proc/self/task')), os.environ['OPENBLAS_NUM_THREADS'])"
    assert _told_at_the_end(count, *SHORT_REPLAY) == ["1", "1"]
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    assert _told_at_the_end(count, "info", LOG) == ["1", "2"]


def test_a_list_that_is_cached_reads_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))
    _loaded(RUN, "list", "logs")
    assert not (NUMBERS | PICTURES | TORCH | {"replayers.runs.run"}) & _loaded(RUN + TELL, "list", "logs")


def test_copies_of_logs_load_no_protobuf() -> None:
    loaded = _loaded(f"import sys, replayers.log_tools.rewrite, replayers.log_tools.recover; {TELL}")
    assert not loaded & (NUMBERS | {"google.protobuf.message"})


def test_the_dashboard_loads_no_planners() -> None:
    loaded = _loaded(f"import sys, dashboards.viser_app.serving; {TELL}")
    assert not loaded & (SCIPY | TORCH | {"numba", "pandas", "pyarrow", "matplotlib", "skimage"})


def test_importing_the_replayers_loads_nothing_but_the_standard_library() -> None:
    bare = _loaded(f"import sys; {TELL}")
    loaded = _loaded(f"import sys; import recorders, replayers; {TELL}") - bare
    assert {name.partition(".")[0] for name in loaded} - sys.stdlib_module_names == {"recorders", "replayers"}


def test_reading_a_log_loads_no_planners() -> None:
    loaded = _loaded(f"import sys, replayers; replayers.read; replayers.messages; {TELL}")
    assert not loaded & (NUMBERS - {"numpy"} | PICTURES | TORCH)


def test_a_planner_from_outside_does_not_wait_for_what_ours_need() -> None:
    loaded = _loaded(f"import sys, replayers.counterfactual.sandbox; {TELL}")
    assert not loaded & (NUMBERS - {"numpy"} | PICTURES | TORCH)


def _told_at_the_end(statement: str, *arguments: str, before: str = "None") -> list[str]:
    """What a statement prints after a command's own output; `before` is an expression of before the command."""
    code = f"import atexit, gc, os; from workbench.__main__ import main; before = {before}"
    ran = subprocess.run(
        [sys.executable, "-c", f"{code}; atexit.register(lambda: {statement}); main()", *arguments],
        capture_output=True, text=True, check=True, cwd=ROOT,
    )  # fmt: skip
    return ran.stdout.splitlines()[-1].split()


def _loaded(code: str, *arguments: str) -> set[str]:
    """The modules that a process has loaded at its end."""
    ran = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(ran.stderr.split())
