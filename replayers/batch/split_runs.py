"""Parts of one recording among the logs of a command: together they are one run, and each alone shows less."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from shlex import quote

from replayers.mcap_io.reader import metadata
from workbench.errors import LiosError
from workbench.log_schema.run_info import INFO_METADATA, PART_METADATA

MAX_NAMED = 20
"""Maximum number of parts that a message lists by name."""


def parts_of_one_run(logs: Iterable[Path]) -> dict[Path, tuple[Path, ...]]:
    """For each log that is a part of a split run, all parts of it that are there; a part alone is left out.

    What cannot be read is no part: reading it says why.
    """
    runs: dict[tuple[tuple[str, str], ...], list[Path]] = {}
    for log in logs:
        try:
            if metadata(log, PART_METADATA) is None:
                continue
            info = metadata(log, INFO_METADATA)
        except (LiosError, OSError):
            continue
        if info:
            runs.setdefault(tuple(sorted(info.items())), []).append(log)
    return {log: tuple(parts) for parts in runs.values() if len(parts) > 1 for log in parts}


def join_first(log: Path, parts: tuple[Path, ...]) -> str:
    """Why a part is not taken for a run, and what to do."""
    names = " ".join(quote(str(part)) for part in parts[:MAX_NAMED])
    more = " ..." if len(parts) > MAX_NAMED else ""
    return (
        f"{log}: one of {len(parts)} parts of one run; each shows only what it holds, and they would count as "
        f"{len(parts)} runs. Join them first: lios log merge {names}{more} -o WHOLE.mcap"
    )
