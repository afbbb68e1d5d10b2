"""Checks of a GraphNav map against a site: its waypoints, its fiducials, and the hash that names it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from bosdyn.api.graph_nav import map_pb2

from recorders.spot.checks.findings import CheckFinding, fine, forbids, warning
from recorders.spot.client.graph_nav_map import graph_hash, waypoint_ids
from recorders.spot.client.map_upload import read_map_folder
from workbench.errors import LiosError
from workbench.terminal import counted
from workbench.worlds.sites.site import Site

SUBJECT = "map"


def map_findings(
    graph: map_pb2.Graph, site: Site, *, snapshots: Iterable[map_pb2.WaypointSnapshot] = ()
) -> list[CheckFinding]:
    """Findings about a map.

    Args:
        graph: as downloaded from the robot, or read from a folder.
        snapshots: what was seen at the waypoints, where it is at hand; it names the map's fiducials.
    """
    if not graph.waypoints:
        return [forbids(SUBJECT, "the robot holds none: load it with the tablet, or give --map with its folder")]
    size = f"{counted(len(graph.waypoints), 'waypoint')}, {counted(len(graph.edges), 'edge')}"
    found = [fine(SUBJECT, f"{graph_hash(graph)}, {size}")]
    _, missing, ambiguous = waypoint_ids(graph, site.waypoints.values())
    if missing:
        found.append(forbids("waypoints", f"the map has no {', '.join(missing[:6])}: another map, or other names"))
    if ambiguous:
        found.append(forbids("waypoints", f"several are called {', '.join(ambiguous[:6])}: give their ids"))
    if not graph.anchoring.anchors and any(place not in site.waypoints for place in site.travel.locations[1:]):
        found.append(forbids("anchors", "places without a waypoint need an anchored map: process it on the tablet"))
    return [*found, *_fiducials(graph, site, snapshots)]


def map_fiducials(graph: map_pb2.Graph, snapshots: Iterable[map_pb2.WaypointSnapshot]) -> frozenset[int]:
    """The tag numbers of the fiducials that the map is localised by."""
    anchored = {int(thing.id) for thing in graph.anchoring.objects if thing.id.isdecimal()}
    seen = {
        thing.apriltag_properties.tag_id
        for snapshot in snapshots
        for thing in snapshot.objects
        if thing.HasField("apriltag_properties")
    }
    return frozenset(anchored | seen)


def folder_findings(folder: Path, site: Site) -> tuple[list[CheckFinding], map_pb2.Graph | None]:
    """Findings about a map's folder, which needs no robot; the graph is None where it cannot be uploaded."""
    try:
        graph, snapshots, _ = read_map_folder(folder)
    except LiosError as error:
        return [forbids("map folder", str(error))], None
    return map_findings(graph, site, snapshots=snapshots.values()), graph


def _fiducials(graph: map_pb2.Graph, site: Site, snapshots: Iterable[map_pb2.WaypointSnapshot]) -> list[CheckFinding]:
    known = map_fiducials(graph, snapshots)
    both = sorted(known & set(site.tags))
    if both:
        what = ", ".join(f"{tag} ({site.tags[tag].id})" for tag in both[:6])
        return [forbids("fiducials", f"the site's items and the map use the same tags: {what}. Renumber the items")]
    if not known:
        return [warning("fiducials", "the map names none, so it is not known whether tags of items are among them")]
    return [fine("fiducials", f"{counted(len(known), 'tag')} of the map, none of them an item's")]
