"""The git revision of the running code, recorded with every run."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Revision:
    """A git commit, and whether the working tree was modified; empty for an installed package."""

    commit: str = ""
    dirty: bool = False


@cache
def revision() -> Revision:
    """The revision of the running source tree; empty if it is not a git checkout or git is missing."""
    if not (SOURCE / ".git").exists():
        return Revision()
    commit = _git("rev-parse", "HEAD")
    if commit is None:
        return Revision()
    return Revision(commit=commit.strip(), dirty=bool(_git("status", "--porcelain", "--untracked-files=no")))


def _git(*words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(SOURCE), *words], capture_output=True, text=True, timeout=10, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None
