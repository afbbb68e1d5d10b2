"""Compiled functions on disk: what was cut off, or rests on what has changed, is compiled again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

MODULE = """
from workbench.third_party.kernels import kernel

@kernel()
def doubled(x):
    return 2.0 * x

print(doubled(21.0), sum(doubled.stats.cache_hits.values()))
"""


def told(folder: Path) -> list[str]:
    command = [sys.executable, str(folder / "doubling.py")]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.ci
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_a_file_that_was_cut_off_is_made_again(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "doubling.py").write_text(MODULE)
    assert [told(tmp_path), told(tmp_path)] == [["42.0", "0"], ["42.0", "1"]]
    (kept,) = (tmp_path / "cache").rglob(f"*.{suffix}")
    kept.write_bytes(kept.read_bytes()[: 0 if suffix == "nbi" else 40])
    assert [told(tmp_path), told(tmp_path)] == [["42.0", "0"], ["42.0", "1"]]


CALLED = """
from workbench.third_party.kernels import kernel

@kernel()
def times(x):
    return {factor} * x
"""
CALLING = """
import called
from called import times
from workbench.third_party.kernels import kernel

@kernel()
def multiplied(x):
    return twice(x) + inner(x)

@kernel()
def twice(x):
    return called.times(x)

@kernel()
def inner(x):
    return times(x)

print(multiplied(21.0), sum(multiplied.stats.cache_hits.values()))
"""


@pytest.mark.ci
def test_what_calls_a_function_that_has_changed_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    (tmp_path / "doubling.py").write_text(CALLING)
    (tmp_path / "called.py").write_text(CALLED.format(factor=2.0))
    assert [told(tmp_path), told(tmp_path)] == [["84.0", "0"], ["84.0", "1"]]
    (tmp_path / "called.py").write_text(CALLED.format(factor=10.0))
    assert told(tmp_path) == ["420.0", "0"]


CONSTANTS = """
from typing import NamedTuple

FACTOR, SHIFT = {factor}, {shift}

class Pair(NamedTuple):
    {fields}
"""
BY_CONSTANTS = """
import constants
from constants import FACTOR, Pair
from workbench.third_party.kernels import kernel

@kernel()
def moved(pair: Pair) -> float:
    return scaled(pair) + constants.SHIFT

@kernel()
def scaled(pair: "Pair") -> float:
    return FACTOR * pair.a - pair.b

print(moved(Pair(a=21.0, b=1.0)), sum(moved.stats.cache_hits.values()))
"""


@pytest.mark.ci
@pytest.mark.parametrize(
    ("changed", "answer"),
    [({"factor": 10.0}, "209.5"), ({"shift": 7.0}, "48.0"), ({"fields": "b: float; a: float"}, "41.5")],
)
def test_what_names_a_constant_of_another_module_that_has_changed_is_made_again(
    tmp_path: Path, changed: dict[str, object], answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    was = {"factor": 2.0, "shift": 0.5, "fields": "a: float; b: float"}
    (tmp_path / "doubling.py").write_text(BY_CONSTANTS)
    (tmp_path / "constants.py").write_text(CONSTANTS.format(**was))
    assert [told(tmp_path), told(tmp_path)] == [["41.5", "0"], ["41.5", "1"]]
    (tmp_path / "constants.py").write_text(CONSTANTS.format(**was | changed))
    assert told(tmp_path) == [answer, "0"]
