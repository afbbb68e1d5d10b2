"""Entry point of `lios` and `python -m workbench`.

Importing the command line takes a moment; Ctrl-C during the import is handled here too. Python looks for garbage
again and again while modules are loaded, and once more at the end, although what they make stays. In a short replay
that is a fifth of its processor time. So garbage is looked for less often, and no more at the end.
"""

from __future__ import annotations

import atexit
import gc
import sys

NEW_OBJECTS = 20_000
"""Allocations before the garbage collector runs; 700 unless set."""


def main() -> None:
    """Run the command line and exit with its code."""
    gc.set_threshold(NEW_OBJECTS)
    atexit.register(gc.freeze)
    try:
        from workbench.cli import main as run

        run()
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
