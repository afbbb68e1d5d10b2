"""The only code that reads MCAP: runs, data frames, the logged world, counterfactuals, salvage.

import replayers
run = replayers.read("run.mcap")
table = replayers.read_many("logs/**")
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from replayers.mcap_io.reader import messages
    from replayers.runs.run import Run, read
    from replayers.tables.frames import read_many

_WHERE = {
    "read": "replayers.runs.run",
    "Run": "replayers.runs.run",
    "read_many": "replayers.tables.frames",
    "messages": "replayers.mcap_io.reader",
}

__all__ = ["Run", "messages", "read", "read_many"]


def __getattr__(name: str) -> Any:
    """Imports a public name on first use, so that `import replayers` stays light."""
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_WHERE[name]), name)
