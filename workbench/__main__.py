"""Entry point of `lios` and `python -m workbench`.

Importing the command line takes a moment; Ctrl-C during the import is handled here too.
"""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line and exit with its code."""
    try:
        from workbench.cli import main as run

        run()
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
