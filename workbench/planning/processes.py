"""How is another program run safely? The one door that starts processes: limits on time, memory and output.

A program that crashes, hangs, fills the disk or the memory is an Answer with a status. Its children die with it:
it gets a process group of its own, and the whole group is killed.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

MOST_OUTPUT_BYTES = 1_000_000
MOST_FILE_BYTES = 256 * 2**20
MEMORY_BYTES = 2 * 2**30


class Exit(StrEnum):
    ENDED = "ended"
    """By itself, with a return code."""
    TIMED_OUT = "timed-out"
    CRASHED = "crashed"
    """Killed by a signal, its memory limit among them."""
    NOT_STARTED = "not-started"


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What became of it. output: the first megabyte of what it said, errors included."""

    exit: Exit
    code: int = 0
    output: str = ""


def run_program(
    command: Sequence[str],
    *,
    folder: Path,
    time_s: float,
    memory_bytes: int = MEMORY_BYTES,
    stdin: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Answer:
    """Runs a program to its end or its limits.

    Args:
        folder: its working folder.
        time_s: wall-clock seconds; also the limit of its processor time.
        memory_bytes: address space.
        stdin: a file to read from; nothing if not given.
        environment: variables set besides the present ones.
    """
    if not _can_be_started(command[0], folder):
        return Answer(exit=Exit.NOT_STARTED, output=f"{command[0]}: no such program")
    with tempfile.TemporaryFile() as output, open(stdin or os.devnull, "rb") as source:
        try:
            process = subprocess.Popen(
                [*_limits(time_s, memory_bytes), *command],
                stdin=source,
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd=folder,
                start_new_session=True,
                env={**os.environ, **(environment or {})},
            )
        except (OSError, ValueError) as error:
            return Answer(exit=Exit.NOT_STARTED, output=str(error))
        try:
            process.wait(timeout=max(time_s, 0.001))
            timed_out = False
        except subprocess.TimeoutExpired:
            timed_out = True
        finally:
            _kill(process)
        output.seek(0)
        said = output.read(MOST_OUTPUT_BYTES).decode("utf-8", errors="replace")
    if timed_out or process.returncode == -signal.SIGXCPU:
        return Answer(exit=Exit.TIMED_OUT, code=process.returncode, output=said)
    crashed = process.returncode < 0
    return Answer(exit=Exit.CRASHED if crashed else Exit.ENDED, code=process.returncode, output=said)


def _can_be_started(program: str, folder: Path) -> bool:
    """Looked for on the path, or from the working folder where the name has a folder."""
    return shutil.which(program) is not None or shutil.which(str(folder / program)) is not None


def _limits(time_s: float, memory_bytes: int) -> tuple[str, ...]:
    """A shell that limits itself and then becomes the program: no moment is left without limits.

    A limit that a system does not know is left out.
    """
    limits = (("c", 0), ("f", MOST_FILE_BYTES // 512), ("t", int(time_s) + 1), ("v", memory_bytes // 1024))
    set_all = "; ".join(f"ulimit -{letter} {limit} 2>/dev/null" for letter, limit in limits)
    return ("/bin/sh", "-c", f'{set_all}; exec "$@"', "sh")


def _kill(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
