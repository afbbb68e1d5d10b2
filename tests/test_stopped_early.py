"""Ctrl-C while the command line is still loading is handled as later: one word, exit code 1."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import pytest

from workbench.__main__ import main


@pytest.fixture(autouse=True)
def _keeps_its_collector(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the command sets for its own process is not for that of the tests."""
    monkeypatch.setattr("gc.set_threshold", lambda *_: None)
    monkeypatch.setattr("atexit.register", lambda *_: None)


class Interrupted:
    """Finds one module, and is interrupted while it loads it."""

    def __init__(self, name: str) -> None:
        self.name = name

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name == self.name:
            raise KeyboardInterrupt


@pytest.mark.parametrize("module", ["workbench.cli", "click"])
def test_stopped_during_its_imports(module: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    for name in ("workbench.cli", "click"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(sys, "meta_path", [Interrupted(module), *sys.meta_path])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 1
    assert capsys.readouterr().err == "Stopped.\n"


def test_it_is_what_the_command_starts():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())
    assert project["project"]["scripts"] == {"lios": "workbench.__main__:main"}


def test_it_runs_the_command_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(sys, "argv", ["lios", "--version"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    assert "lios-workbench" in capsys.readouterr().out
