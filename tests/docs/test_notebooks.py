"""The notebooks run from start to end over the sample logs."""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path

import pytest
from console_blocks import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_there_are_some_and_none_names_a_machine() -> None:
    assert len(NOTEBOOKS) >= 3
    for notebook in NOTEBOOKS:
        text = notebook.read_text(encoding="utf-8")
        assert str(Path.home()) + "/" not in text
        assert str(ROOT) not in text
        assert "subprocess" not in text, "a notebook calls functions and starts no command"


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_runs(notebook: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat = pytest.importorskip("nbformat", reason="needs the extra notebooks")
    nbclient = pytest.importorskip("nbclient", reason="needs the extra notebooks")
    pytest.importorskip("ipykernel", reason="needs the extra notebooks")
    pytest.importorskip("duckdb", reason="needs the extra notebooks")
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent) + os.pathsep + os.environ["PATH"])
    with warnings.catch_warnings():
        # Jupyter's own warnings: of its transport, and of its platform directories.
        warnings.simplefilter("ignore")
        content = nbformat.read(notebook, as_version=4)
        client = nbclient.NotebookClient(content, timeout=600, resources={"metadata": {"path": str(notebook.parent)}})
        client.execute()
    outputs = [output for cell in content.cells for output in cell.get("outputs", [])]
    assert any(output.output_type == "display_data" for output in outputs), "nothing was drawn"
