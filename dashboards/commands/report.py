"""`lios report`: one HTML page and the figures of an evaluation of tasks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Json
from workbench.parameters import Argument


def report(
    folder: Annotated[Path, Argument(help="The output folder of lios evaluate tasks.", local=True)],
    as_json: Json = False,
) -> None:
    """Make an HTML page and PNG and PDF figures of an evaluation of tasks.

    Examples:

        lios report out
    """
    from dashboards.task_report import write_report
    from workbench.terminal import emit_json, say

    page, figures = write_report(folder)
    if as_json:
        emit_json({"page": str(page), "figures": [str(path) for path in figures]})
    else:
        say(f"Wrote {page} and {len(figures)} figures (PNG and PDF) to {folder / 'figures'}.")
