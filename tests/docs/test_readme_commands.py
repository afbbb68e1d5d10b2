"""Every command of README.md runs and prints what README.md shows."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from console_blocks import PROCTHOR, ROOT, Command, blocks_of, environment, needs_procthor, prepare, run_page

README = ROOT / "README.md"


def _make_commands() -> list[Command]:
    return [c for block in blocks_of(README) for c in block.commands if c.text.startswith("make ")]


def test_the_two_commands_come_first() -> None:
    assert [c.text for c in _make_commands()][:2] == ["make demo", "make test"]


@pytest.mark.parametrize("command", [c.text for c in _make_commands()])
def test_make_knows(command: str) -> None:
    planned = subprocess.run(
        ["make", "-n", command.split()[1]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert planned.returncode == 0, planned.stderr


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_make_demo_prints_what_readme_shows(tmp_path: Path) -> None:
    shown = next(c for c in _make_commands() if c.text == "make demo").shown
    made = subprocess.run(
        ["make", "demo", f"DEMO_OPTIONS=--no-view -o {tmp_path}/demo"],
        cwd=ROOT,
        env=environment() | {"PYTHONWARNINGS": "default"},  # it may install, and installers warn
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stdout
    printed = {" ".join(line.split()).replace(f"{tmp_path}/", "") for line in made.stdout.splitlines()}
    # The last two lines are of the dashboard, which --no-view does not open.
    compared = [line for line in shown if line.strip() and not line.startswith(("3.", "Dashboard"))]
    assert len(compared) > 8
    for line in compared:
        assert " ".join(line.split()) in printed, line


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_the_other_commands_do_what_readme_shows(tmp_path: Path) -> None:
    if needs_procthor(README) and not PROCTHOR.exists():
        pytest.skip(f"no ProcTHOR houses at {PROCTHOR}")
    prepare(tmp_path)
    wrong = run_page(README, tmp_path)
    assert not wrong, "\n\n".join(wrong)
