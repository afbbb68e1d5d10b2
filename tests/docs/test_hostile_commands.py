"""Whatever is typed, a person gets one line that says what is wrong, and the exit code of bad input."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from console_blocks import ROOT

from workbench import cli

LOG = ROOT / "logs" / "find-lios.mcap"
WRONG = (
    "record --find mug --seed -1",
    "record --find mug --known nan",
    "record --find unobtainium",
    "record --find mug --scenario deliver-3",
    "record --task folder",
    "record --find mug --house noise",
    "record --find mug --house folder",
    "plan LOG --at nan",
    "plan LOG --budget inf",
    "replay LOG --strategies ''",
    "replay LOG --strategies ,",
    "replay LOG --timeout nan",
    "replay LOG --seed -1",
    "compare folder",
    "report folder",
    "houses info folder",
    "houses info noise",
    "houses stats noise",
    "evaluate belief --seed -1",
    "evaluate belief --estimators ''",
    "evaluate belief --figures noise",
    "evaluate search --workers 0",
    "evaluate replay --strategies ''",
    "evaluate replay --strategies nope,lios",
    "evaluate replay --strategies lios",
    "evaluate replay --scenarios nope",
    "evaluate spot --strategies ''",
    "train --houses noise",
    "view LOG --at nan",
    "render LOG --at inf",
    "render LOG -o frame.gif",
    "render LOG --video -o film.png",
    "info folder",
    "info noise",
)


@pytest.mark.parametrize("line", WRONG)
def test_one_line_and_exit_2(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "noise").write_bytes(bytes(range(255, 0, -1)))
    assert cli.run(shlex.split(line.replace("LOG", str(LOG)))) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("lios: ")
    assert len(said.err.strip().splitlines()) == 1, said.err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "noise"], "it left something behind"


def test_a_folder_without_an_evaluation_says_how_to_make_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["report", str(tmp_path)]) == 2
    assert "lios evaluate tasks" in capsys.readouterr().err


def test_ranges_stay_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["plan", "--help"]) == 0
    assert "x>=0.0" in " ".join(capsys.readouterr().out.split())
