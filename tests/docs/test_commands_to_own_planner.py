"""From a clone to a planner of one's own over a shipped log: the tutorial's own commands, counted and run."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from console_blocks import ROOT, blocks_of, environment, prepare

PAGE = ROOT / "docs" / "tutorials" / "replay-your-own-planner.md"
MAX_COMMANDS = 12


def commands() -> list[str]:
    """All commands of the page up to the first replay of the planner over a log of logs/, one a command."""
    found: list[str] = []
    for command in (command for block in blocks_of(PAGE) for command in block.commands):
        found += re.split(r"\s*(?:&&|;|\|)\s*", command.text)
        if re.match(r"lios replay logs/\S+ .*my_planner:MyPlanner", command.text):
            return found
    raise AssertionError("the page replays no planner over a shipped log")


def test_at_most_twelve_commands_lead_from_the_clone_to_the_replay() -> None:
    made = commands()
    assert made[0].startswith("git clone ")
    assert len(made) <= MAX_COMMANDS, made


def test_those_after_the_installation_do_it(tmp_path: Path) -> None:
    made = commands()
    prepare(tmp_path)
    for command in made[made.index("pip install .") + 1 :]:
        done = _ran(command, tmp_path)
    assert re.search(r"my-planner\b.*\d", done), done


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_all_of_them_do_it(tmp_path: Path) -> None:
    """From a real clone of what is committed here, in one shell, with the packages that were tested together."""
    made = [
        command.replace("ADDRESS", str(ROOT)).replace("pip install", "pip install --constraint constraints.txt")
        for command in commands()
    ]
    done = subprocess.run(
        ["bash", "-ec", "\n".join(made)], cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False
    )
    if re.search(r"name resolution|[Cc]onnection|unreachable|timed out", done.stderr):
        pytest.skip("no package registry can be reached")
    assert done.returncode == 0, done.stderr
    assert re.search(r"my-planner\b.*\d", done.stdout), done.stdout


def _ran(command: str, folder: Path) -> str:
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
