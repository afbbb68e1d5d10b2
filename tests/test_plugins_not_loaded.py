"""A module that cannot be imported or is of no use: one clear line of every kind and command, exit 2."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from workbench.beliefs.estimators import estimator
from workbench.cli import run
from workbench.planning.solvers.registry import solver
from workbench.planning.strategies import strategy
from workbench.plugins import NameOrigin, PluginNotLoaded
from workbench.search.policies.registry import policy

LOG = str(Path(__file__).parents[1] / "logs" / "find-lios.mcap")
BROKEN = {
    "missing_import": ("import nothing_there\nMine = None\n", "ModuleNotFoundError: No module named 'nothing_there'"),
    "bad_syntax": ("class Mine\n", "SyntaxError"),
    "divides": ("1 / 0\n", "ZeroDivisionError"),
    "leaves": ("raise SystemExit(0)\n", "SystemExit"),
    "no_file": ("def Mine(house=None):\n    raise OSError('no file')\n", "OSError: no file"),
    "of_no_kind": ("class Mine:\n    pass\n", "it is Mine; a"),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, (text, _) in BROKEN.items():
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("module", BROKEN)
@pytest.mark.parametrize("made", [strategy, policy, estimator, solver], ids=lambda made: made.__name__)
def test_each_kind_says_why_in_one_line(made: Callable[..., object], module: str, folder: Path) -> None:
    with pytest.raises(PluginNotLoaded) as refused:
        made(f"{module}:Mine", origin=NameOrigin.USER)
    said = str(refused.value)
    assert BROKEN[module][1] in said
    assert "\n" not in said
    assert said.endswith("or install what it imports.")


@pytest.mark.parametrize(
    "words",
    [
        ("record", "--find", "mug", "-o", "x.mcap", "--strategy"),
        ("replay", LOG, "--in-process", "-s"),
        ("replay", LOG, "-s"),
        ("plan", LOG, "-s"),
        ("evaluate", "tasks", "--trials", "1", "-o", "t", "-s"),
        ("evaluate", "replay", "-n", "1", "-s"),
        ("evaluate", "search", "--queries", "1", "-o", "s", "-p"),
        ("record", "--find", "mug", "-o", "x.mcap", "--estimator"),
    ],
    ids=lambda words: " ".join(word for word in words if "/" not in word),
)
def test_each_command_says_what_is_not_there(
    words: tuple[str, ...], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([*words, "missing_import:Mine"]) == 2
    said = capsys.readouterr().err.strip()
    assert "No module named 'nothing_there'" in said
    assert "\n" not in said
    assert not list(folder.glob("*.mcap"))
