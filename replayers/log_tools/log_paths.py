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
            paths = [p for p in path.matching() if p.suffix == ".mcap"]
        elif path.is_dir():
            paths = sorted(path.rglob("*.mcap"))
        elif path.exists():
            paths = [path]
        else:
            paths = [p for p in sorted(map(Path, glob.glob(str(one), recursive=True))) if p.suffix == ".mcap"]
        if not paths:
            raise NoLogs(str(one))
        found.update(dict.fromkeys(paths))
    return list(found)


def shown(path: Path | str) -> str:
    """A path as text that any file format can hold: bytes that are not UTF-8 become replacement characters."""
    return str(path).encode("utf-8", "surrogateescape").decode("utf-8", "replace")
