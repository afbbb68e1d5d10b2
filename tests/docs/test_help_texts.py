"""Help texts: completion is available, and every example can be copied as one line."""

from __future__ import annotations

import shutil
import subprocess
from importlib.metadata import entry_points

import pytest

from workbench import cli


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_printed_for(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["--completion", shell]) == 0
    assert "_LIOS_COMPLETE" in capsys.readouterr().out


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_takes_the_completion(capsys: pytest.CaptureFixture[str]) -> None:
    cli.run(["--completion", "bash"])
    script = capsys.readouterr().out
    took = subprocess.run(["bash", "-c", f"{script}\ncomplete -p lios"], capture_output=True, text=True, check=False)
    assert took.returncode == 0, took.stderr
    assert took.stdout.strip().endswith("lios")


@pytest.mark.parametrize("name", sorted(entry.name for entry in entry_points(group="lios.commands")))
def test_examples_stand_on_one_line_each(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([*name.split("."), "--help"]) == 0
    shown = capsys.readouterr().out
    _, _, examples = shown.partition("Examples:")
    examples = examples.partition("\nOptions:")[0].partition("\nArguments:")[0]
    lines = [line.strip() for line in examples.splitlines() if line.strip()]
    assert lines
    for line in lines:
        assert line.startswith(("lios ", "#", "LIOS_")) or " | " in line, f"broken over two lines: {line}"
