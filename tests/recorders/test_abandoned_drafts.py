"""Hidden part files of killed commands are removed by the next command that writes there."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from sample_logs import write_toy_log

from workbench import cli


def test_the_next_command_removes_what_a_killed_one_left(tmp_path: Path):
    log, output = write_toy_log(tmp_path / "a.mcap"), tmp_path / "b.mcap"
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    left = tmp_path / f".b.mcap.{ended.pid}.part"
    in_use = tmp_path / f".b.mcap.{os.getppid()}.part"
    other = tmp_path / f".c.mcap.{ended.pid}.part"
    for draft in (left, in_use, other):
        draft.write_bytes(b"half")
    assert cli.run(["log", "compact", str(log), "-o", str(output)]) == 0
    assert (left.exists(), in_use.exists(), other.exists()) == (False, True, True)
