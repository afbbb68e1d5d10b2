"""`lios site from-graph-nav`: drafts a survey from a recorded GraphNav map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Json
from workbench.parameters import Argument, Option


def from_graph_nav(
    folder: Annotated[
        Path, Argument(help="Folder of a GraphNav map: graph, waypoint_snapshots, edge_snapshots.", local=True)
    ],
    output: Annotated[Path, Option("--output", "-o", help="Folder for site.yaml, travel.csv and the map.")] = (
        Path("site")
    ),
    name: Annotated[str, Option("--name", help="Name of the site; default: the folder's.")] = "",
    force: Annotated[bool, Option("--force", help="Replace a site in the folder.")] = False,
    json: Json = False,
) -> None:
    """Draft the survey of a place from a GraphNav map: waypoints, edges, and a map of its point clouds.

    Named waypoints become containers; if none is named, all do.

    Examples:

        lios site from-graph-nav downloaded_graph/ -o home

        lios site check home/site.yaml
    """
    from replayers.sites.graph_nav_draft import draft_from_graph_nav
    from replayers.sites.survey_draft import write_draft
    from workbench.errors import OutputExists
    from workbench.terminal import counted, emit_json, emit_table, say

    if (output / "site.yaml").exists() and not force:
        raise OutputExists(output / "site.yaml")
    made = draft_from_graph_nav(folder)
    draft = made.draft
    file = write_draft(draft, output, name=name or output.resolve().name)
    if json:
        emit_json(
            {
                "site": str(file),
                "waypoints": made.waypoints,
                "edges": made.edges,
                "disconnected": list(made.disconnected),
                "containers": {stop.name: stop.waypoint for stop in draft.stops},
                "other_tags": {number: list(place) for number, place in draft.other_tags.items()},
                "map": draft.grid is not None,
                "unread_clouds": made.unread_clouds,
            }
        )
        return
    emit_table(
        [
            {
                "container": stop.name,
                "x_m": stop.pose.x_m,
                "y_m": stop.pose.y_m,
                "from_start_m": float(draft.metres[0, i + 1]),
                "waypoint": stop.waypoint,
            }
            for i, stop in enumerate(draft.stops)
        ]
    )
    if made.disconnected:
        say(f"{counted(len(made.disconnected), 'waypoint')} left out: no edge connects them with the start.")
    if made.unread_clouds:
        say(f"{counted(made.unread_clouds, 'snapshot')} left out of the map: missing, or its points are packed.")
    whose = "the named ones" if made.named_only else "all but the start, because none has a name"
    tags = draft.other_tags
    found = f"{counted(len(tags), 'tag')} of the map" + (", a map" if draft.grid is not None else "")
    say(f"{counted(len(draft.stops), 'container')} ({whose}), {found}: {file}")
    if tags:
        say(f"Items need other tags than {', '.join(map(str, tags))}, by which the robot finds itself on this map.")
    say(f"Name the containers, delete the other waypoints. Next: lios site check {file}")
