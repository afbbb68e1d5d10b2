"""`lios site from-log`: drafts a survey from a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Json
from workbench.parameters import Argument, Option


def from_log(
    log: Annotated[Path, Argument(help="A recording: lios spot record, or an imported bag.")],
    output: Annotated[Path, Option("--output", "-o", help="Folder for site.yaml, travel.csv and the map.")] = (
        Path("site")
    ),
    name: Annotated[str, Option("--name", help="Name of the site; default: the folder's.")] = "",
    map_folder: Annotated[
        Path | None, Option("--map", help="The GraphNav map of the place: its fiducials are not items.")
    ] = None,
    force: Annotated[bool, Option("--force", help="Replace a site in the folder.")] = False,
    json: Json = False,
) -> None:
    """Draft the survey of a place from a recording: stops, waypoints, walked lengths, tags, map.

    Drive the robot around, stop for a few seconds in front of each container, then name the containers in the
    draft.

    Examples:

        lios spot record --robot 192.168.80.3 -o round.mcap && lios site from-log round.mcap -o home

        lios site check home/site.yaml
    """
    from replayers.sites.survey_draft import draft_site, write_draft
    from workbench.errors import OutputExists
    from workbench.terminal import emit_json, emit_table, say

    if (output / "site.yaml").exists() and not force:
        raise OutputExists(output / "site.yaml")
    map_tags: frozenset[int] = frozenset()
    if map_folder is not None:
        from recorders.spot.client.errors import require_bosdyn

        require_bosdyn()
        from recorders.spot.checks.map_checks import map_fiducials
        from recorders.spot.client.map_upload import read_map_folder

        graph, snapshots, _ = read_map_folder(map_folder)
        map_tags = map_fiducials(graph, snapshots.values())
    draft = draft_site(log, map_tags=map_tags)
    file = write_draft(draft, output, name=name or output.resolve().name)
    if json:
        emit_json(
            {
                "site": str(file),
                "stops": [stop.name for stop in draft.stops],
                "waypoints": {stop.name: stop.waypoint for stop in draft.stops if stop.waypoint},
                "tags": sorted(draft.tags),
                "other_tags": sorted(draft.other_tags),
                "map": draft.grid is not None,
            }
        )
        return
    if draft.stops:
        emit_table(
            [
                {
                    "container": stop.name,
                    "x_m": stop.pose.x_m,
                    "y_m": stop.pose.y_m,
                    "stood_s": stop.seconds,
                    "waypoint": stop.waypoint or None,
                    "from_start_m": float(draft.metres[0, i + 1]),
                }
                for i, stop in enumerate(draft.stops)
            ]
        )
    say(f"{len(draft.stops)} stops, {len(draft.tags)} tags{', a map' if draft.grid is not None else ''}: {file}")
    say(f"Name the containers and items there. Next: lios site check {file}")
