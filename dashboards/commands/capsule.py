"""`lios capsule`: runs as one HTML file that plays offline."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Force, Json
from workbench.parameters import Argument, Option


def capsule(
    logs: Annotated[list[Path], Argument(help="Logs of one task, or a folder of them; the first is in focus.")],
    output: Annotated[Path, Option("-o", "--output", help="The HTML file to write.")] = Path("run.html"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Put runs into one HTML file that plays offline, with 3D, decisions and tables.

    Examples:

        lios capsule run.mcap -o run.html

        lios capsule lios.mcap greedy.mcap -o both.html
    """
    from dashboards.capsule.write import write_capsule
    from dashboards.library.same_place import read_together, same_house
    from replayers.commands.losses import end_with_losses
    from replayers.runs.gaps import losses
    from workbench.errors import BadValue
    from workbench.terminal import emit_json, say

    if output.suffix.lower() not in (".html", ".htm"):
        raise BadValue("-o/--output", str(output), "a name that ends in .html")
    together = read_together(logs)
    timelines = together.timelines
    size = write_capsule(timelines, output, force=force)
    found = losses(timeline.run for timeline in same_house(timelines))
    if as_json:
        emit_json(
            {
                "output": str(output),
                "bytes": size,
                "runs": len(same_house(timelines)),
                "left_out": together.left_out,
                "lost": found.lost,
                "cut_off": found.cut_off,
            }
        )
    else:
        say(f"Wrote {output} ({size / 1e6:.2f} MB). Open it in a browser; it needs no network.")
    end_with_losses(found, unreadable=len(together.unreadable))
