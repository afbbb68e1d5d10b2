"""The only code that reads MCAP: runs, data frames, the logged world, counterfactuals, salvage.

import replayers
run = replayers.read("run.mcap")
table = replayers.read_many("logs/**")
replays = replayers.replay("run.mcap", ["greedy", "lios"])
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from replayers.batch.replays import Replays, compare, look_next, replay
    from replayers.batch.verify import Verification, verify
    from replayers.counterfactual.prepared_log import ReplaySettings
    from replayers.mcap_io.reader import messages
    from replayers.runs.run import Run, read
    from replayers.tables.export import export
    from replayers.tables.frames import read_many

_WHERE = {
    "ReplaySettings": "replayers.counterfactual.prepared_log",
    "Replays": "replayers.batch.replays",
    "Run": "replayers.runs.run",
    "Verification": "replayers.batch.verify",
    "compare": "replayers.batch.replays",
    "export": "replayers.tables.export",
    "look_next": "replayers.batch.replays",
    "messages": "replayers.mcap_io.reader",
    "read": "replayers.runs.run",
    "read_many": "replayers.tables.frames",
    "replay": "replayers.batch.replays",
    "verify": "replayers.batch.verify",
}

__all__ = [
    "ReplaySettings",
    "Replays",
    "Run",
    "Verification",
    "compare",
    "export",
    "look_next",
    "messages",
    "read",
    "read_many",
    "replay",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Imports a public name on first use, so that `import replayers` stays light."""
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_WHERE[name]), name)
