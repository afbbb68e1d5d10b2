"""Finds the logs that a folder, a pattern, a file, or several of these mean."""

from __future__ import annotations

import glob
from collections.abc import Iterable
from pathlib import Path

from workbench.errors import NotFound
from workbench.remote.path import RemotePath, path_of


class NoLogs(NotFound):
    """A pattern or folder without a log."""

    def __init__(self, where: str) -> None:
        super().__init__(f"{where}: no log there. Give files, a folder, or a pattern such as 'logs/**/*.mcap'.")


def find_logs(where: str | Path | Iterable[str | Path]) -> list[Path]:
    """The .mcap files that are meant, sorted, without duplicates.

    Raises:
        NoLogs: there is none.
    """
    wanted = [where] if isinstance(where, str | Path) else list(where)
    found: dict[Path, None] = {}
    for one in wanted:
        path = path_of(one)
        if isinstance(path, RemotePath) and path.is_pattern():
            paths = matching_logs(path)
        elif path.is_dir():
            paths = sorted(path.rglob("*.mcap"))
        elif path.exists():
            paths = [path]
        else:
            paths = matching_logs(path)
        if not paths:
            raise NoLogs(str(one))
        found.update(dict.fromkeys(paths))
    return list(found)


def matching_logs(pattern: Path) -> list[Path]:
    """The .mcap files that a pattern means, here or at an address, sorted."""
    if isinstance(pattern, RemotePath):
        paths = pattern.matching() if pattern.is_pattern() else ()
    else:
        paths = sorted(map(Path, glob.glob(str(pattern), recursive=True)))
    return [path for path in paths if path.suffix == ".mcap"]


def shown(path: Path | str) -> str:
    """A path as text that any file format can hold: bytes that are not UTF-8 become replacement characters."""
    return str(path).encode("utf-8", "surrogateescape").decode("utf-8", "replace")
