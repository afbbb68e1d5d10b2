"""Running external programs with limits on time, memory and output: the only module that starts processes.

A program that crashes, hangs, or fills the disk or the memory yields an Answer with a status. It runs in its own
process group, which is killed as a whole, so that its children die with it.
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

MAX_OUTPUT_BYTES = 1_000_000
MAX_FILE_BYTES = 256 * 2**20
MEMORY_BYTES = 2 * 2**30
HEAP_SHARE = 0.7
"""Share of the memory limit that a Java virtual machine may use for its heap; the rest is its code and threads."""


class MemoryLimit(StrEnum):
    """What a limit on memory counts."""

    ADDRESS_SPACE = "v"
    """All that is mapped (RLIMIT_AS)."""
    DATA = "d"
    """What is mapped writable (RLIMIT_DATA), for programs that reserve more address space than they use: a Java
    virtual machine does not start under a limit of 2 GiB on its address space."""


class Exit(StrEnum):
    """How an external program ended."""

    ENDED = "ended"
    """The program exited by itself, with a return code."""
    TIMED_OUT = "timed-out"
    CRASHED = "crashed"
    """The program was killed by a signal, for example at its memory limit."""
    NOT_STARTED = "not-started"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramResult:
    """How a program ended. `output` is the first megabyte of its standard output and error."""

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
    limited: MemoryLimit = MemoryLimit.ADDRESS_SPACE,
) -> ProgramResult:
    """Run a program until it exits or reaches a limit.

    Args:
        folder: working folder of the program.
        time_s: limit on wall-clock time in seconds, and on processor time for each core (RLIMIT_CPU counts all
            threads of a process together).
        memory_bytes: limit on memory of each of its processes.
        stdin: file for standard input; empty input by default.
        environment: environment variables added to the current ones.
        limited: what memory_bytes counts.
    """
    if not _program_exists(command[0], folder):
        return ProgramResult(exit=Exit.NOT_STARTED, output=f"{command[0]}: no such program")
    with tempfile.TemporaryFile() as output, open(stdin or os.devnull, "rb") as source:
        try:
            process = subprocess.Popen(
                [*_limits(time_s, memory_bytes, limited), *command],
                stdin=source,
                stdout=output,
                stderr=subprocess.STDOUT,
                cwd=folder,
                start_new_session=True,
                env={**os.environ, **(environment or {})},
            )
        except (OSError, ValueError) as error:
            return ProgramResult(exit=Exit.NOT_STARTED, output=str(error))
        try:
            process.wait(timeout=max(time_s, 0.001))
            timed_out = False
        except subprocess.TimeoutExpired:
            timed_out = True
        finally:
            _kill(process)
        output.seek(0)
        said = output.read(MAX_OUTPUT_BYTES).decode("utf-8", errors="replace")
    if timed_out or process.returncode == -signal.SIGXCPU:
        return ProgramResult(exit=Exit.TIMED_OUT, code=process.returncode, output=said)
    crashed = process.returncode < 0
    return ProgramResult(exit=Exit.CRASHED if crashed else Exit.ENDED, code=process.returncode, output=said)


def _program_exists(program: str, folder: Path) -> bool:
    """Whether the program exists: searched on PATH, or relative to the working folder if the name contains a
    folder."""
    return shutil.which(program) is not None or shutil.which(str(folder / program)) is not None


def java_heap(memory_bytes: int) -> Mapping[str, str]:
    """The environment variable that bounds the heap of a Java virtual machine within a memory limit."""
    return {"JAVA_TOOL_OPTIONS": f"-Xmx{int(HEAP_SHARE * memory_bytes) // 2**20}m -XX:+UseSerialGC"}


def _limits(time_s: float, memory_bytes: int, limited: MemoryLimit) -> tuple[str, ...]:
    """The shell command that sets its own limits and then executes the program, so that it never runs without
    limits.

    Limits that the system does not support are skipped.
    """
    processor_s = (int(time_s) + 1) * (os.cpu_count() or 1)
    limits = (("c", 0), ("f", MAX_FILE_BYTES // 512), ("t", processor_s), (limited.value, memory_bytes // 1024))
    set_all = "; ".join(f"ulimit -{letter} {limit} 2>/dev/null" for letter, limit in limits)
    return ("/bin/sh", "-c", f'{set_all}; exec "$@"', "sh")


def _kill(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
