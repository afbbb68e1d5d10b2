"""The documentation site builds strictly: no broken reference, no docstring that cannot be read."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from console_blocks import ROOT


@pytest.mark.slow
def test_strict_build(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="needs the extra docs")
    pytest.importorskip("mkdocstrings", reason="needs the extra docs")
    made = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(tmp_path / "site")],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    commands = (tmp_path / "site" / "reference" / "commands.html").read_text(encoding="utf-8")
    assert "lios evaluate search" in commands
    assert "cannot be loaded" not in commands
    events = (tmp_path / "site" / "reference" / "events.html").read_text(encoding="utf-8")
    assert "/search/observation" in events
    tables = (tmp_path / "site" / "reference" / "tables.html").read_text(encoding="utf-8")
    assert "counter-clockwise from x" in tables
