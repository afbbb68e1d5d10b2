"""Where are results kept that can be worked out again? In `~/.cache/lios-workbench`, in `$LIOS_CACHE`, or nowhere."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path | None:
    """The folder; None where nothing is to be kept (`LIOS_CACHE=off`), or where nobody's home is known."""
    chosen = os.environ.get("LIOS_CACHE", "")
    if chosen.lower() == "off":
        return None
    if chosen:
        return Path(chosen)
    try:
        return Path.home() / ".cache" / "lios-workbench"
    except RuntimeError:
        return None
