"""Hidden part files of killed commands are removed by the next command that writes there, and nothing else is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from sample_logs import write_toy_log

from workbench import cli

KILLED = """
import os, signal, sys, threading
from pathlib import Path
from workbench.files import draft_path
for output in sys.argv[1:]:
    draft = draft_path(Path(output))
    draft.parent.mkdir(parents=True, exist_ok=True)
    if draft.name.startswith(".tables."):
        draft.mkdir()
        draft = draft / "runs.parquet"
    draft.write_bytes(b"half")
os.kill(os.getpid(), signal.SIGKILL)
"""


def _left_by_a_killed_command(*outputs: Path) -> list[Path]:
    """The drafts that a process left, which was killed while it wrote these files."""
    ended = subprocess.run([sys.executable, "-c", KILLED, *map(str, outputs)], check=False)
    assert ended.returncode == -signal.SIGKILL
    left = [draft for output in outputs for draft in output.parent.glob(f".{output.name}.*.part")]
    assert len(left) == len(outputs)
    return left


@pytest.mark.ci_but(1)
@pytest.mark.parametrize(
    ("command", "output", "draft"),
    [
        ("log compact LOG -o OUT", "b.mcap", "b.mcap"),
        ("log compact LOG -o OUT", "b.mcap", "another.mcap"),
        ("recover LOG -o OUT", "b.mcap", "b.mcap"),
        ("log convert LOG -o OUT", "b.jsonl", "b.jsonl"),
        ("export LOG -o OUT -t runs", "folder", "folder/tables"),
        ("export LOG -o OUT -t runs", "b.parquet", "b.parquet"),
        ("capsule LOG -o OUT", "b.html", "b.html"),
    ],
)
def test_the_next_command_removes_what_a_killed_one_left(command: str, output: str, draft: str, tmp_path: Path):
    log = write_toy_log(tmp_path / "a.mcap")
    (left,) = _left_by_a_killed_command(tmp_path / draft)
    words = command.replace("LOG", str(log)).replace("OUT", str(tmp_path / output)).split()
    assert cli.run(words) == 0
    assert not left.exists()
    assert (tmp_path / output).exists()


def test_the_next_replay_removes_what_a_killed_one_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    log, folder = write_toy_log(tmp_path / "a.mcap"), tmp_path / "replays"
    replay = ["replay", str(log), "-s", "opt-greedy", "--worlds", "0", "-o", str(folder)]
    assert cli.run(replay) == 0
    (stored,) = folder.rglob("*.replay.json")
    stored.unlink()
    (left,) = _left_by_a_killed_command(stored)
    monkeypatch.setattr("workbench.files._SEARCHED", set[Path]())  # the next process
    assert cli.run(replay) == 0
    assert stored.exists()
    assert not left.exists()


def test_drafts_of_living_processes_and_of_other_machines_and_other_files_stay(tmp_path: Path):
    log = write_toy_log(tmp_path / "a.mcap")
    (left,) = _left_by_a_killed_command(tmp_path / "b.mcap")
    *start, process, machine, part = left.name.split(".")
    here = f"{int(machine, 16) ^ 1:08x}"
    stay = [
        tmp_path / ".".join([*start, str(os.getppid()), machine, part]),
        tmp_path / ".".join([*start, process, here, part]),
        tmp_path / f".b.mcap.{process}.part",
        tmp_path / f"b.mcap.1.{process}.{machine}.part",
        tmp_path / "notes.part",
    ]
    for draft in stay:
        draft.write_bytes(b"half")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "mine").write_bytes(b"mine")
    link = tmp_path / ".".join([*start[:-1], "7", process, machine, part])
    link.symlink_to(tmp_path / "elsewhere")
    assert cli.run(["log", "compact", str(log), "-o", str(tmp_path / "b.mcap")]) == 0
    assert not left.exists()
    assert not link.is_symlink()
    assert (tmp_path / "elsewhere" / "mine").exists()
    assert all(draft.exists() for draft in stay)
