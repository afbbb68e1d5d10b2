"""Compiled functions from disk: their LLVM code is parsed when something is compiled, which may then call them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from workbench.third_party.kernels import is_tried

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


def _printed(folder: Path, *arguments: str) -> list[str]:
    command = [sys.executable, str(folder / "doubling.py"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.split()
