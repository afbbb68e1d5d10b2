"""The folder of the on-disk cache: `~/.cache/lios-workbench`, or what `LIOS_CACHE` names.

The cache holds only results that can be recomputed.
"""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path | None:
    """The cache folder; None if caching is off (`LIOS_CACHE=off`) or no home directory is known."""
    chosen = os.environ.get("LIOS_CACHE", "")
    if chosen.lower() == "off":
        return None
    if chosen:
        return Path(chosen)
    try:
        return Path.home() / ".cache" / "lios-workbench"
    except RuntimeError:
        return None
