"""Check of the disk that a log is written to."""

from __future__ import annotations

import shutil
from pathlib import Path

from recorders.spot.checks.findings import CheckFinding, fine, forbids, warning

WARNING_MINUTES, MIN_MINUTES = 60.0, 10.0
"""Minutes of recording below which the disk is worth a warning, and below which it forbids a run."""


def disk_finding(output: Path, bytes_per_s: float) -> CheckFinding:
    """For how many minutes of recording the disk has room.

    Args:
        output: the log that would be written.
        bytes_per_s: how fast it would grow.
    """
    folder = output.absolute().parent
    if not folder.is_dir():
        return forbids("disk", f"{folder}: no such folder")
    free = shutil.disk_usage(folder).free
    minutes = free / max(bytes_per_s, 1.0) / 60
    text = f"{free / 1e9:.1f} GB free, about {min(minutes, 99_999):.0f} min at {bytes_per_s / 1e6:.2f} MB/s"
    if minutes < MIN_MINUTES:
        return forbids("disk", f"{text}: make room, or use fewer cameras")
    return (warning if minutes < WARNING_MINUTES else fine)("disk", text)
