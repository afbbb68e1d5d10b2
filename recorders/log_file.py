"""Who may write a log's file? One process at a time, and nothing that exists unless it was told to."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from workbench.errors import Failed, FileMissing, InputError, OutputExists, WrongKind
from workbench.file_lock import locked


class CannotCreate(Failed):
    """A file cannot be made there."""

    def __init__(self, path: Path | str, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{path}: cannot be written ({reason}). Choose another -o/--output.")


class BeingWritten(InputError):
    """Another process writes this file."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{path}: another process is writing it. Stop that one, or give another -o/--output.")


def create(path: Path, *, force: bool) -> BinaryIO:
    """A new file, or with force an empty one instead of what was there.

    Raises:
        OutputExists: it exists, and force is not set.
        WrongKind: it is a folder.
        CannotCreate: no permission, or a part of its path is a file.
        BeingWritten: by another process.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | (0 if force else os.O_EXCL), 0o666)
        stream = open(descriptor, "r+b", buffering=0)  # noqa: SIM115
    except FileExistsError:
        if path.exists() and path.is_file():
            raise OutputExists(path) from None
        raise CannotCreate(path, "a part of its path is a file") from None
    except IsADirectoryError:
        raise WrongKind(path, needed="file") from None
    except OSError as error:
        raise CannotCreate(path, error.strerror or str(error)) from error
    reserve(stream, path)
    if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.truncate(0)  # only now: what another process is writing stays as it is
    return stream


def reopen(path: Path, *, size: int | None) -> BinaryIO:
    """A log's file, to be gone on with.

    Args:
        size: in bytes, when it was read; None is any.

    Raises:
        FileMissing: there is none.
        CannotCreate: it may not be written to.
        BeingWritten: by somebody else, now or since it was read.
    """
    try:
        stream = open(path, "r+b", buffering=0)  # noqa: SIM115
    except FileNotFoundError:
        raise FileMissing(path) from None
    except OSError as error:
        raise CannotCreate(path, error.strerror or str(error)) from error
    reserve(stream, path)
    if size is not None and os.fstat(stream.fileno()).st_size != size:
        stream.close()
        raise BeingWritten(path)
    return stream


def part_path(path: Path, number: int) -> Path:
    """The file of a part of a log: run.mcap, 2 -> run_0002.mcap."""
    return path.with_name(f"{path.stem}_{number:04d}{path.suffix or '.mcap'}")


def remove_parts(path: Path, *, beyond: int) -> None:
    """Takes away what an earlier, longer log of that name left, from a part on: it would be taken for the new log's.

    Only parts that follow without a gap; a file that merely has a number in its name stays.

    Raises:
        BeingWritten: the last of them, by another process; then all are left.
    """
    there: list[Path] = []
    while (part := part_path(path, beyond + len(there))).is_file():
        there.append(part)
    for part in reversed(there):
        with reopen(part, size=None):
            part.unlink()


def reserve(stream: BinaryIO, path: Path) -> None:
    """Keeps other writers away until this one closes the file or ends, where the system and the disk can.

    Raises:
        BeingWritten: another one was first.
    """
    if not locked(stream):
        stream.close()
        raise BeingWritten(path)
