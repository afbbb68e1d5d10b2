"""Atomic writes of files, file names made from other names, and the folder of the on-disk cache.

A file is written under a hidden name beside its own, .NAME.THREAD.PROCESS.MACHINE.part, and renamed when it is
complete: readers see the old file or the new one, and never a part. The draft of a killed process is recognised by
the numbers of its process and machine, and removed by the next process that writes into the folder.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import socket
import threading
from collections.abc import Generator
from contextlib import contextmanager, suppress
from errno import EDQUOT, EFBIG, ELOOP, ENOSPC
from functools import cache
from pathlib import Path

from workbench.errors import CannotCreate, InputError, WrongKind

FULL = frozenset({ENOSPC, EDQUOT, EFBIG})
"""Errors of writes for want of room; they name no file."""
MAX_FILE_NAME = 100
"""Longest file name in bytes that is made from another name, without the hash."""
_DRAFT = re.compile(r"\..+\.\d+\.(?P<process>\d+)\.(?P<machine>[0-9a-f]{8})\.part", re.ASCII | re.DOTALL)
_SEARCHED: set[Path] = set()
"""Folders that this process has looked through for abandoned drafts."""


class FolderNotMade(InputError):
    """A folder for the output cannot be made."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: this folder cannot be made: {reason}. Give another path.")


def make_folder(path: Path) -> None:
    """Makes a folder for what is to be written, with its parents, before any work is done for it.

    Raises:
        FolderNotMade: no right to make it, no such device, and the like.
        FileExistsError, NotADirectoryError: a file is in its place.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise
    except OSError as error:
        raise FolderNotMade(path, error.strerror or str(error)) from None


def draft_path(path: Path) -> Path:
    """The hidden name under which this thread writes a file, or a folder, until it is complete."""
    return path.with_name(f".{path.name}.{threading.get_ident()}.{os.getpid()}.{_machine()}.part")


@contextmanager
def atomic(path: Path) -> Generator[Path]:
    """The draft to write, which takes the file's place when the block ends, and is removed if it raises.

    A link is followed. What is no file, such as /dev/stdout, is itself given to be written. Drafts that killed
    processes left in the folder are removed.

    Raises:
        OSError: the draft cannot be written or renamed; it names the file.
    """
    target = target_of(path)
    if target.exists() and not target.is_file():
        with naming(path):
            yield target
        return
    draft = draft_path(target)
    remove_abandoned_drafts(target.parent)
    try:
        yield draft
        replace(draft, target)
    except OSError as error:
        if error.filename == str(draft) or (error.filename is None and error.errno in FULL):
            error.filename = str(path)
        raise
    finally:
        draft.unlink(missing_ok=True)


@contextmanager
def naming(path: Path) -> Generator[None]:
    """Writes to a file that is open: errors for want of room name it."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno in FULL:
            error.filename = str(path)
        raise


def target_of(path: Path) -> Path:
    """The file to which a path leads, also through links, whether it exists or not.

    Raises:
        OSError: the links lead in a circle.
    """
    if not path.is_symlink():
        return path
    with suppress(RuntimeError):  # a circle, before Python 3.13
        found = path.resolve()
        if not found.is_symlink():
            return found
    raise OSError(ELOOP, os.strerror(ELOOP), str(path))


def file_to_replace(path: Path) -> Path:
    """The file that a complete draft takes the place of: that of a link, and nothing that is no file.

    Raises:
        WrongKind: a folder.
        CannotCreate: a device, a pipe, or links in a circle.
    """
    try:
        target = target_of(path)
    except OSError as error:
        raise CannotCreate(path, error.strerror or str(error)) from None
    if target.is_dir():
        raise WrongKind(path, needed="file")
    if target.exists() and not target.is_file():
        raise CannotCreate(path, "it is a device or a pipe, and no file")
    return target


def write_text(path: Path, text: str) -> None:
    """Write a whole file of UTF-8, in place of an existing one.

    Raises:
        OSError: as write_atomically.
    """
    write_atomically(path, text.encode("utf-8"))


def write_atomically(path: Path, data: bytes) -> None:
    """Write a whole file, in place of an existing one.

    Raises:
        OSError: as write_bytes; an existing file is untouched then.
    """
    with atomic(path) as draft:
        draft.write_bytes(data)


def replace(draft: Path, path: Path) -> None:
    """Give a complete draft its final name, in place of an existing file."""
    os.replace(draft, path)


def remove_abandoned_drafts(folder: Path) -> None:
    """Remove the drafts that killed processes of this machine left in a folder; a process looks once.

    A draft of another machine, whose processes cannot be known here, stays; so does one that cannot be removed.
    """
    folder = folder.resolve()
    if folder in _SEARCHED:
        return
    _SEARCHED.add(folder)
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in list(entries):
            found = _DRAFT.fullmatch(entry.name)
            if found is not None and found["machine"] == _machine() and not _runs(int(found["process"])):
                _remove(entry)


def _remove(entry: os.DirEntry[str]) -> None:
    with suppress(OSError):
        if entry.is_dir(follow_symlinks=False):
            shutil.rmtree(entry.path)
        else:
            os.unlink(entry.path)


def file_name_of(name: str, *, shown: str | None = None) -> str:
    """A file name for a name, the same wherever one is made; different names have different file names.

    Letters and digits of any script stay, others become "-"; a name that must be changed or cut gets a hash.

    Args:
        shown: the part of the name that is recognised, such as the last of a path; the whole by default.
    """
    plain = plain_file_name(name if shown is None else shown)
    if name and plain == name:
        return name
    return f"{plain}-{hashlib.sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"


def plain_file_name(name: str) -> str:
    """As file_name_of, without the hash, for names that differ anyway, such as those of houses; may be empty."""
    plain = re.sub(r"[^\w+.@-]+", "-", name).strip("-.")
    return plain.encode("utf-8", "ignore")[:MAX_FILE_NAME].decode("utf-8", "ignore")


@cache
def _machine() -> str:
    """Eight hexadecimal digits for this host and, on Linux, its space of process numbers: a container has its own."""
    try:
        numbers = os.readlink("/proc/self/ns/pid")
    except OSError:
        numbers = ""
    return hashlib.sha256(f"{socket.gethostname()} {numbers}".encode()).hexdigest()[:8]


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True  # somebody else's
    return True


def cache_folder() -> Path | None:
    """The folder of results that can be recomputed: ~/.cache/lios-workbench, or what LIOS_CACHE names.

    None if caching is off (LIOS_CACHE=off) or no home directory is known.
    """
    chosen = os.environ.get("LIOS_CACHE", "")
    if chosen.lower() == "off":
        return None
    if chosen:
        return Path(chosen)
    try:
        return Path.home() / ".cache" / "lios-workbench"
    except RuntimeError:
        return None
