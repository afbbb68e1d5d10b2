"""`lios figures`: figures of runs for papers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Force, Json
from workbench.parameters import Argument, Option


def figures(
    logs: Annotated[list[Path], Argument(help="Logs of one task, or a folder of them; the first is in focus.")],
    output: Annotated[Path, Option("-o", "--output", help="The folder to write to.")] = Path("figures"),
    format_: Annotated[
        list[str] | None, Option("--format", help="pdf, svg or png; may be repeated; default: pdf and png.")
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw figures of runs: paths from above, belief maps, cost over time, the plan as a Gantt chart, a comparison.

    Examples:

        lios figures run.mcap -o figures/

        lios figures lios.mcap greedy.mcap --format svg -o figures/
    """
    from dashboards.figures.files import write_figures
    from dashboards.library.same_place import read_together, same_house
    from replayers.commands.losses import end_with_losses
    from replayers.runs.gaps import losses
    from workbench.terminal import emit_json, say

    together = read_together(logs)
    timelines = same_house(together.timelines)
    written = write_figures(timelines, output, formats=tuple(format_ or ("pdf", "png")), force=force)
    found = losses(timeline.run for timeline in timelines)
    if as_json:
        emit_json(
            {
                "files": [str(path) for path in written],
                "left_out": together.left_out,
                "lost": found.lost,
                "cut_off": found.cut_off,
            }
        )
    else:
        say(f"Wrote {len(written)} figures to {output}.")
    end_with_losses(found, unreadable=len(together.unreadable))
