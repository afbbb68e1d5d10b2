"""`lios capsule`, `figures`, `view`, `render`: runs that are left out are reported, mistakes give one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from workbench import cli

LOGS = Path(__file__).resolve().parents[2] / "logs"
FIND, ELSEWHERE = str(LOGS / "find-lios.mcap"), str(LOGS / "deliver-3.mcap")


def test_a_capsule_says_which_runs_it_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["capsule", FIND, ELSEWHERE, "-o", str(tmp_path / "run.html"), "--json"]) == 0
    said = capsys.readouterr()
    assert "Left out:" in said.err
    assert "deliver-3.mcap is of houses:5, not of houses:9" in said.err
    answer = json.loads(said.out)
    assert (answer["runs"], answer["left_out"]) == (1, [ELSEWHERE])
    assert (tmp_path / "run.html").stat().st_size == answer["bytes"]


def test_figures_say_which_runs_they_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["figures", FIND, ELSEWHERE, "-o", str(tmp_path), "--format", "svg"]) == 0
    assert "Left out:" in capsys.readouterr().err
    assert not (tmp_path / "comparison.svg").exists(), "one run is left, and nothing to compare it with"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["view", "{empty}"], "no .mcap logs in this folder"),
        (["view", "{empty}/none.mcap"], "no such file"),
        (["view", FIND, "--port", "99999"], "from 0 to 65535"),
        (["capsule", "{empty}"], "no .mcap logs"),
        (["figures", FIND, "--format", "exe", "-o", "{empty}"], "one of pdf, svg, png"),
        (["render", FIND, "--walls", "paper", "-o", "{empty}/x.png"], "cut, whole or none"),
        (["render", FIND, "--video", "--speed", "0", "-o", "{empty}/x.mp4"], "0.01"),
    ],
)
def test_mistakes_take_one_line_and_exit_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    assert cli.run([word.replace("{empty}", str(tmp_path)) for word in words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
