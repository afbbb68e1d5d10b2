"""Entry point of `lios` and `python -m workbench`.

Importing the command line takes a moment; Ctrl-C during the import is handled here too. Two things that a short
command would spend a sixth of its processor time on are kept from it:

- Python looks for garbage again and again while modules are loaded, and once more at the end, although what they make
  stays. So garbage is looked for less often, and no more at the end.
- The linear algebra that comes with numpy starts a thread for each core as soon as numpy is loaded. They serve large
  matrices, and the workbench multiplies none; torch, which does, has threads of its own.
"""

from __future__ import annotations

import atexit
import gc
import os
import sys

NEW_OBJECTS = (200_000, 5, 1)
"""Allocations before garbage is looked for among new objects, such looks before one among older objects, and those
before one among all; 700, 10 and 10 unless set. All that a replay loads is fewer, and all garbage is found after as
many allocations as with 20,000, 10 and 10."""

THREADS = "OPENBLAS_NUM_THREADS"
"""The variable that says how many threads numpy starts. A user's own setting stays."""


def main() -> None:
    """Run the command line and exit with its code."""
    gc.set_threshold(*NEW_OBJECTS)
    atexit.register(gc.freeze)
    os.environ.setdefault(THREADS, "1")
    try:
        from workbench.cli import main as run

        run()
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
