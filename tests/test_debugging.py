"""`--debug`: a planner's own traceback with its line, from whatever process it ran in; without it, none."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from workbench import cli
from workbench.debugging import debugging, show_traceback
from workbench.errors import Failed

PLANNER = """
class Breaks:
    name = "breaks"

    def relevant_types(self, task):
        return ()

    def decide(self, view):
        return self.further(view)

    def further(self, view):
        raise ValueError("no idea")  # the line
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "breaking_planner.py").write_text(PLANNER)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("more", [[], ["--in-process"]])
def test_replay_shows_the_users_own_line_once(
    more: list[str], folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log = Path(__file__).parents[1] / "logs" / "find-lios.mcap"
    line = ["replay", str(log), "-s", "breaking_planner:Breaks", "--worlds", "5", *more]
    with pytest.raises(Failed, match="breaks broke"):
        cli.main(["--debug", *line])
    shown = capfd.readouterr().err
    assert shown.count("# the line") == 1
    assert f'{folder / "breaking_planner.py"}", line 12, in further' in shown
    assert "sandbox.py" not in shown, "our own frames come before the user's"
    with pytest.raises(SystemExit):
        cli.main(line)
    assert "Traceback" not in capfd.readouterr().err


def test_the_wish_ends_with_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    before = os.environ.get("LIOS_DEBUG")
    with debugging():
        show_traceback(ValueError("shown"))
        show_traceback(ValueError("shown"))
    show_traceback(ValueError("hidden"))
    assert capsys.readouterr().err.count("ValueError: shown") == 1
    assert os.environ.get("LIOS_DEBUG") == before
