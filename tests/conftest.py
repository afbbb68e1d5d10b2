"""Shared fixtures: a small house worked out by hand, and the real houses where they are available."""

from __future__ import annotations

import gc
import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from work_groups import BROWSER, group_of, turn_of

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # Started in the background by a shell: processes that tests start and interrupt would ignore the interrupt too.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Set in many containers; with it, no test would see what a buffer keeps back.
os.environ.pop("PYTHONUNBUFFERED", None)

# Set in many containers; with it, every process that a test starts would compile every module anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# What importing the tests makes stays to the end: collecting it again and again finds nothing.
gc.disable()

# The same examples in every run, on however slow a machine: what fails is due to a change. LIOS_EXPLORE=1: new ones.
settings.register_profile(
    "lios",
    deadline=None,
    derandomize=not os.environ.get("LIOS_EXPLORE"),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("lios")

PROCTHOR = Path(os.environ.get("LIOS_PROCTHOR", Path(__file__).resolve().parents[2] / "shared" / "procthor"))


@pytest.fixture(scope="session")
def procthor() -> Path:
    """The folder of real ProcTHOR houses; skips where it is absent."""
    if not (PROCTHOR / "multi_room_train.jsonl.gz").exists():
        pytest.skip(f"no ProcTHOR houses at {PROCTHOR}; set LIOS_PROCTHOR to their folder")
    return PROCTHOR


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Tests do not read or write the user's cache."""
    os.environ["LIOS_CACHE"] = str(tmp_path_factory.mktemp("lios-cache"))


def pytest_collection_finish() -> None:
    """Garbage is collected from here on, and no longer looked for among what collecting tests has made. Seldom:
    looking through the objects of a whole suite again and again takes a twentieth of its time."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Workers take modules and groups of modules, in the order of `work_groups`."""
    from xdist.scheduler import LoadScopeScheduling

    class Groups(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return group_of(nodeid.partition("::")[0])

    config.option.loadscopereorder = False
    return Groups(config, log)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Browser tests run one after another: a second browser on two cores makes both miss their time-outs. Benchmarks
    are slow tests: their set-ups are as large as what they measure."""
    for item in items:
        if item.path.parent.name == "benchmarks":
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("browser") is not None:
            assert group_of(item.path.name) == BROWSER, f"{item.path} is to be in the browser's group"
    _leave_cases_to_ci(items)
    items.sort(key=lambda item: turn_of(item.path.as_posix()))


def _leave_cases_to_ci(items: list[pytest.Item]) -> None:
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("ci_but") is not None and item.get_closest_marker("slow") is None:
            cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for those in cases.values():
        marker = those[0].get_closest_marker("ci_but")
        assert marker is not None
        kept = {case * len(those) // marker.args[0] for case in range(marker.args[0])}
        for number, item in enumerate(those):
            if number not in kept:
                item.add_marker(pytest.mark.ci)
