"""Newer releases of what this needs may deprecate things; that fails no test of those who have them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from console_blocks import ROOT


@pytest.mark.ci
@pytest.mark.parametrize(
    ("kind", "module", "options", "fails"),
    [
        ("RuntimeWarning", "workbench.beliefs.fake", [], True),
        ("RuntimeWarning", "numpy.fake", [], False),
        ("DeprecationWarning", "numpy.fake", [], False),
        ("DeprecationWarning", "workbench.beliefs.fake", [], False),
        ("DeprecationWarning", "numpy.fake", ["-W", "error"], True),
    ],
)
def test_whose_warnings_are_errors(kind: str, module: str, options: list[str], fails: bool, tmp_path: Path) -> None:
    """Ours are; with the versions that were tested together (make test) all are."""
    code = f"def test_it():\n    warnings.warn_explicit('old', {kind}, 'f.py', 1, module={module!r})\n"
    (tmp_path / "test_it.py").write_text(f"import warnings\n{code}", encoding="utf-8")
    plain = ["-p", "no:cacheprovider", "--rootdir", str(tmp_path), "-c", str(ROOT / "pyproject.toml")]
    words = [sys.executable, "-m", "pytest", *plain, "-o", "pythonpath=", *options, str(tmp_path)]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == int(fails), done.stdout + done.stderr
