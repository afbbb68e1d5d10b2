"""What a user types into a terminal: a debugger that stops in a planner, and Tab in bash."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from planner_file import write_planner
from terminal_session import TerminalSession

LOG = Path(__file__).parents[1] / "logs" / "find-lios.mcap"
SCRIPTS = Path(sys.executable).parent
REPLAY = [sys.executable, "-m", "workbench", "replay", str(LOG), "-s", "mine:Mine", "--in-process", "--worlds", "0"]
PDB = "(Pdb) "


def environment() -> dict[str, str]:
    """Without what would choose another debugger, or start bash otherwise."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONBREAKPOINT", "BASH_ENV")}
    return kept | {"PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}", "LIOS_CACHE": "off"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_planner(tmp_path / "mine.py", first="breakpoint()")
    return tmp_path


def test_a_breakpoint_in_a_planner_stops_and_answers(folder: Path) -> None:
    with TerminalSession(REPLAY, folder=folder, env=environment()) as terminal:
        assert "mine.py(16)decide()" in terminal.read_until(PDB)
        terminal.type("p view.knowledge.robot_at, 6 * 7\n")
        assert "('start', 42)" in terminal.read_until(PDB)
        terminal.type("import sys; sys.breakpointhook = lambda: None\n")
        terminal.read_until(PDB)
        terminal.type("c\n")
        code, shown = terminal.end()
    assert code == 0, shown
    assert "mine" in shown
    assert "undetermined" in shown


def test_leaving_the_debugger_ends_the_command(folder: Path) -> None:
    with TerminalSession(REPLAY, folder=folder, env=environment()) as terminal:
        terminal.read_until(PDB)
        terminal.type("q\n")
        code, shown = terminal.end()
    assert code == 1
    assert shown.splitlines()[-1] == "Stopped."
    assert "broke" not in shown


BASH = shutil.which("bash") or "bash"


def completed(line: str, folder: Path) -> list[str]:
    """What bash offers after a line, by the function that `lios --completion bash` defines."""
    words = line.split(" ")
    script = 'eval "$(lios --completion bash)"; complete -p lios; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
    script += "$(complete -p lios | sed 's/.*-F \\([^ ]*\\).*/\\1/') lios; printf '%s\\n' \"${COMPREPLY[@]}\""
    done = subprocess.run(
        [BASH, "--norc", "-c", script, "bash", *words],
        cwd=folder,
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()[1:]


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_options_and_values(folder: Path) -> None:
    assert completed("lios rep", folder) == ["replay", "report"]
    assert completed("lios replay x.mcap --strategies opt-greedy,pes-l", folder) == ["opt-greedy,pes-lios"]


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_tab_completes_a_value(folder: Path) -> None:
    with TerminalSession([BASH, "--norc", "--noprofile", "-i"], folder=folder, env=environment()) as terminal:
        terminal.type("PS1='ready> '; eval \"$(lios --completion bash)\"; echo loa''ded\n")
        terminal.read_until("loaded\n")
        terminal.read_until("ready> ")
        terminal.type("echo lios; lios record --strategy scout\t")
        terminal.read_until("--strategy scout-lios ")
        terminal.type("--help > help.txt; exit\n")
        assert terminal.end()[0] == 0
    assert "lios record" in (folder / "help.txt").read_text()
