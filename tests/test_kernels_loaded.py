"""Compiled functions from disk: what numba prepares in order to compile waits until something is compiled."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workbench.third_party.loaded_kernels import is_tried

MODULE = """
import sys
from numba import njit
from workbench.third_party.kernels import kernel

@kernel()
def doubled(x):
    return 2.0 * x

def known(function):
    (loaded,) = function.overloads.values()
    return len(list(loaded.library._get_module_for_linking().functions))

print(doubled(21.0), sum(doubled.stats.cache_hits.values()), known(doubled) > 0)
if "compile" in sys.argv:
    decorator = njit if "theirs" in sys.argv else kernel()
    print(decorator(lambda x: doubled(x) + 1.0)(20.0), known(doubled) > 0)
"""


@pytest.mark.skipif(not is_tried(), reason="numba loads its functions itself")
@pytest.mark.parametrize("whose", ["ours", pytest.param("theirs", marks=pytest.mark.ci)])
def test_a_function_from_disk_is_linked_with_one_that_is_compiled_later(
    tmp_path: Path, whose: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "doubling.py").write_text(MODULE)
    assert _printed(tmp_path) == ["42.0", "0", "True"]
    assert _printed(tmp_path) == ["42.0", "1", "False"]
    assert _printed(tmp_path, "compile", whose) == ["42.0", "1", "False", "41.0", "True"]


ARRAYS = """
import sys
import numpy as np
from numba import njit
from numba.core import entrypoints
from numba.core.runtime.nrt import rtsys
from workbench.third_party.kernels import kernel

@kernel()
def counted(n):
    out = np.zeros(n)
    for i in range(n):
        out[i] = i
    return out

@kernel()
def put(out, given):
    out[:] = given
    return out.sum()

def refused(given):
    try:
        put(np.zeros(3), given)
    except Exception as error:
        return str(error)

print(counted(4).sum(), put(np.zeros(3), counted(3)), refused(np.zeros(2)), sep="|", end="|")
print(rtsys._init, entrypoints._already_initialized, "numpy.ma" in sys.modules, end="|")
print("Unsupported array type" in refused(np.ma.zeros((2, 2))), end="|")
print(njit(lambda n: counted(n) + 1.0)(3).sum(), rtsys._init, entrypoints._already_initialized)
"""


@pytest.mark.skipif(not is_tried(), reason="numba loads its functions itself")
def test_arrays_are_made_and_refused_without_the_compiler_as_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "doubling.py").write_text(ARRAYS)
    made = ["6.0", "3.0", "cannot assign slice of shape (3,) from input of shape (2,)"]
    later = ["True", "6.0 True True"]
    assert " ".join(_printed(tmp_path)).split("|") == [*made, "True True True", *later]
    assert " ".join(_printed(tmp_path)).split("|") == [*made, "False False False", *later]


CALLED_NEVER = """
from workbench.third_party.kernels import kernel

@kernel()
def never(x):
    return x
"""


def test_a_function_that_is_not_called_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "doubling.py").write_text(CALLED_NEVER)
    _printed(tmp_path)
    assert not (tmp_path / "cache").exists()


def _printed(folder: Path, *arguments: str) -> list[str]:
    command = [sys.executable, str(folder / "doubling.py"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.split()
