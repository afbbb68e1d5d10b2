"""Recording of runs and robots: the only package that writes MCAP.

import recorders
end = recorders.record("run.mcap", find="mug", strategy="lios")
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from recorders.record_run import record

_WHERE = {"record": "recorders.record_run"}

__all__ = ["record"]


def __getattr__(name: str) -> Any:
    """Imports a public name on first use, so that `import recorders` stays light."""
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_WHERE[name]), name)
