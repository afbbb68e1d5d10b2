"""The GraphNav map of the simulated robot: derived from the site, or uploaded."""

from __future__ import annotations

from collections.abc import Mapping

from bosdyn.api.graph_nav import map_pb2

from recorders.spot.simulated.body import Body, wrapped
from recorders.spot.simulated.frames import from_body, in_body, inverse, se3, yaw_of
from workbench.worlds.geometry import Pose
from workbench.worlds.sites.site import Site


class GraphMap:
    """Waypoints with poses in the seed frame (the site's map), and their graph.

    Attributes:
        waypoints: poses by id. snapshots: uploaded snapshots by id.
    """

    def __init__(self, site: Site, fiducials: Mapping[int, tuple[float, float, float]]) -> None:
        names = {place: site.waypoints.get(place) or f"wp-{place}" for place in site.travel.locations}
        self.waypoints = {name: site.navigation.standing[place] for place, name in names.items()}
        self.graph = _graph_of(self.waypoints, site)
        for tag, (x, y, z) in fiducials.items():
            self.graph.anchoring.objects.add(id=str(tag), seed_tform_object=se3(x, y, z, 0.0))
        self.snapshots: dict[str, bytes] = {w.snapshot_id: b"" for w in self.graph.waypoints}

    def clear(self) -> None:
        self.waypoints, self.graph, self.snapshots = {}, map_pb2.Graph(), {}

    def load(self, graph: map_pb2.Graph) -> None:
        """Load a graph; its anchoring gives the waypoint poses."""
        for anchor in graph.anchoring.anchors:
            at = anchor.seed_tform_waypoint
            self.waypoints[anchor.id] = Pose(x_m=at.position.x, y_m=at.position.y, yaw_rad=yaw_of(at.rotation))
        self.graph.MergeFrom(graph)

    def unknown_snapshots(self, graph: map_pb2.Graph) -> list[str]:
        """The snapshots of a graph's waypoints that are not uploaded yet."""
        wanted = (waypoint.snapshot_id for waypoint in graph.waypoints)
        return [name for name in wanted if name and name not in self.snapshots]

    def nearest(self, pose: Pose) -> str:
        """The waypoint nearest to a pose."""
        return min(
            self.waypoints,
            key=lambda n: (self.waypoints[n].x_m - pose.x_m) ** 2 + (self.waypoints[n].y_m - pose.y_m) ** 2,
        )


def shifted(pose: Pose, x: float, y: float, turn: float) -> Pose:
    """A pose shifted within its own frame."""
    moved = from_body(Body(pose=pose, speed_mps=1.0), (x, y, 0.0))
    return Pose(x_m=moved[0], y_m=moved[1], yaw_rad=wrapped(pose.yaw_rad + turn))


def relative(origin: Pose, pose: Pose) -> Pose:
    """A pose relative to another."""
    x, y, _ = in_body(Body(pose=origin, speed_mps=1.0), (pose.x_m, pose.y_m, 0.0))
    return Pose(x_m=x, y_m=y, yaw_rad=wrapped(pose.yaw_rad - origin.yaw_rad))


def _graph_of(waypoints: dict[str, Pose], site: Site) -> map_pb2.Graph:
    graph = map_pb2.Graph()
    for name, pose in waypoints.items():
        waypoint = graph.waypoints.add(id=name, snapshot_id=f"snapshot-{name}", waypoint_tform_ko=inverse(pose, 0.0))
        waypoint.annotations.name = name.removeprefix("wp-")
        graph.anchoring.anchors.add(id=name, seed_tform_waypoint=se3(pose.x_m, pose.y_m, 0.0, pose.yaw_rad))
    for a, b in _tree(list(waypoints), site):
        edge = graph.edges.add()
        edge.id.from_waypoint, edge.id.to_waypoint = a, b
        shift = relative(waypoints[a], waypoints[b])
        edge.from_tform_to.CopyFrom(se3(shift.x_m, shift.y_m, 0.0, shift.yaw_rad))
    return graph


def _tree(names: list[str], site: Site) -> list[tuple[str, str]]:
    """A spanning tree of the waypoints by walking distance (Prim)."""
    metres = site.travel.metres
    joined, edges = [0], []
    while len(joined) < len(names):
        _, a, b = min((metres[i, j], i, j) for i in joined for j in range(len(names)) if j not in joined)
        edges.append((names[a], names[b]))
        joined.append(b)
    return edges
