"""`lios site from-graph-nav`: drafts a survey from a recorded GraphNav map."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from workbench.options import Json
from workbench.parameters import Argument, Option

if TYPE_CHECKING:
    from recorders.spot.client.graph_nav_map import SnapshotFault

MAX_NAMED = 4
"""Waypoints that a message names."""


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

    Named waypoints become containers; if none is named, all do. Where snapshots are missing or damaged, the draft is
    made of the others, a warning names their waypoints, and the exit code is 3.

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
                "unread_clouds": len(made.unread),
                "unread": dict(made.unread),
            }
        )
        _end_with_losses(made.unread)
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
    whose = "the named ones" if made.named_only else "all but the start, because none has a name"
    tags = draft.other_tags
    found = f"{counted(len(tags), 'tag')} of the map" + (", a map" if draft.grid is not None else "")
    say(f"{counted(len(draft.stops), 'container')} ({whose}), {found}: {file}")
    if tags:
        say(f"Items need other tags than {', '.join(map(str, tags))}, by which the robot finds itself on this map.")
    say(f"Name the containers, delete the other waypoints. Next: lios site check {file}")
    _end_with_losses(made.unread)


def _end_with_losses(unread: Mapping[str, SnapshotFault]) -> None:
    """Says which snapshots are in neither the map nor the tags.

    Raises:
        click.exceptions.Exit: with 3, where there is one.
    """
    import click

    from workbench.errors import first_few
    from workbench.terminal import counted, say

    by_fault: dict[SnapshotFault, list[str]] = {}
    for waypoint, fault in unread.items():
        by_fault.setdefault(fault, []).append(waypoint)
    for fault, waypoints in by_fault.items():
        of = f"{counted(len(waypoints), 'snapshot')} {'is' if len(waypoints) == 1 else 'are'} {fault}"
        say(
            f"warning: {of}: what the robot saw from {first_few(waypoints, MAX_NAMED)} is not in the draft. "
            "Download the map again for it."
        )
    if unread:
        raise click.exceptions.Exit(3)
