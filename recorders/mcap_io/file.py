"""Creating and locking log files: one writer at a time, and no overwriting unless requested."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from workbench.errors import CannotCreate, FileMissing, InputError, OutputExists, WrongKind
from workbench.file_lock import locked


class LogInUse(InputError):
    """Another process is writing this file."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{path}: another process is writing it. Stop that one, or give another -o/--output.")


def create(path: Path, *, force: bool) -> BinaryIO:
    """Create a file; with force, replace an existing one.

    Raises:
        OutputExists: it exists, and force is not set.
        WrongKind: it is a folder.
        CannotCreate: no permission, or a component of its path is a file.
        LogInUse: another process is writing it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | (0 if force else os.O_EXCL), 0o666)
        stream = open(descriptor, "r+b", buffering=0)  # noqa: SIM115 - the caller closes it
    except FileExistsError:
        if path.exists() and path.is_file():
            raise OutputExists(path) from None
        raise CannotCreate(path, "a part of its path is a file") from None
    except IsADirectoryError:
        raise WrongKind(path, needed="file") from None
    except OSError as error:
        raise CannotCreate(path, error.strerror or str(error)) from error
    lock_file(stream, path)
    if stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.truncate(0)  # truncate only after locking, so that a file in use stays unchanged
    return stream


def reopen(path: Path, *, size: int | None) -> BinaryIO:
    """Open an existing log to append to it.

    Args:
        size: its expected size in bytes, as when it was read; None for any.

    Raises:
        FileMissing: it does not exist.
        CannotCreate: it is not writable.
        LogInUse: another process is writing it, or has changed it since it was read.
    """
    try:
        stream = open(path, "r+b", buffering=0)  # noqa: SIM115 - the caller closes it
    except FileNotFoundError:
        raise FileMissing(path) from None
    except OSError as error:
        raise CannotCreate(path, error.strerror or str(error)) from error
    lock_file(stream, path)
    if size is not None and os.fstat(stream.fileno()).st_size != size:
        stream.close()
        raise LogInUse(path)
    return stream


def part_path(path: Path, number: int) -> Path:
    """The file of a part of a log: run.mcap, 2 -> run_0002.mcap."""
    return path.with_name(f"{path.stem}_{number:04d}{path.suffix or '.mcap'}")


def remove_parts(path: Path, *, beyond: int) -> None:
    """Remove left-over parts of an earlier, longer log of the same name, which would be taken for parts of the new
    one.

    Only consecutive parts are removed, not other files with a number in their name.

    Raises:
        LogInUse: another process is writing the last of them; then none is removed.
    """
    there: list[Path] = []
    while (part := part_path(path, beyond + len(there))).is_file():
        there.append(part)
    for part in reversed(there):
        with reopen(part, size=None):
            part.unlink()


def lock_file(stream: BinaryIO, path: Path) -> None:
    """Lock a file against other writers until it is closed, where the system supports it.

    Raises:
        LogInUse: another process holds the lock.
    """
    if not locked(stream):
        stream.close()
        raise LogInUse(path)
