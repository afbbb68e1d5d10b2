"""`lios figures`: figures of runs for papers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.options import Json


def figures(
    logs: Annotated[list[Path], typer.Argument(help="Logs of one task; the first is in focus.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The folder to write to.")] = Path("figures"),
    format_: Annotated[list[str] | None, typer.Option("--format", help="pdf, svg or png; again for more.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files.")] = False,
    as_json: Json = False,
) -> None:
    """Draw figures of runs: ways from above, belief maps, cost over time, the plan as a Gantt chart, a comparison.

    Examples:

        lios figures run.mcap -o figures/

        lios figures lios.mcap greedy.mcap --format svg -o figures/
    """
    from dashboards.figures.files import write_figures
    from dashboards.library import Library
    from dashboards.one_place import here, say_left_out
    from workbench.terminal import emit_json, say

    library = Library(logs)
    timelines = [library.timeline(i) for i in range(len(library.paths))]
    say_left_out(timelines)
    written = write_figures(here(timelines), output, formats=tuple(format_ or ("pdf", "png")), force=force)
    if as_json:
        emit_json({"files": [str(path) for path in written]})
    else:
        say(f"Wrote {len(written)} figures to {output}.")
