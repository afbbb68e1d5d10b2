"""A GraphNav map becomes a draft of a survey: poses, lengths, tags and a map of its point clouds."""

from __future__ import annotations

import json
import os
from math import pi
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bosdyn.api")

from bosdyn.api import geometry_pb2, point_cloud_pb2
from bosdyn.api.graph_nav import map_pb2
from bosdyn.client.math_helpers import Quat, SE3Pose

from replayers.sites.graph_nav_draft import draft_from_graph_nav
from replayers.sites.survey_draft import NothingToDraft, write_draft
from workbench.cli import run as lios
from workbench.errors import FileMissing
from workbench.worlds.house import START, LocationId
from workbench.worlds.sites.site import load_site

GRAPHS = Path(os.environ.get("LIOS_GRAPHNAV", Path(__file__).resolve().parents[3] / "shared" / "graphnav"))
REAL = GRAPHS / "jeangillain__52wp"


def se3(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> geometry_pb2.SE3Pose:
    return SE3Pose(x=x, y=y, z=z, rot=Quat.from_yaw(yaw)).to_proto()


def link(tree: geometry_pb2.FrameTreeSnapshot, child: str, parent: str, pose: geometry_pb2.SE3Pose) -> None:
    edge = tree.child_to_parent_edge_map[child]
    edge.parent_frame_name = parent
    edge.parent_tform_child.CopyFrom(pose)


def write_map(folder: Path, *, names: tuple[str, ...] = ("waypoint_0", "waypoint_1", "waypoint_2")) -> Path:
    """An L: 2 m ahead, a turn to the left, 3 m ahead; a tag 1 m before the last waypoint, a wall beside the first.

    The wall is 1 m to the left. A fourth waypoint is connected with nothing. Bodies are 0.5 m above the floor.
    """
    graph = map_pb2.Graph()
    for number, name in enumerate((*names, "alone")):
        waypoint = graph.waypoints.add(id=f"id{number}", snapshot_id=f"snap{number}")
        waypoint.annotations.name = name
        waypoint.annotations.creation_time.FromSeconds(100 + number)
        waypoint.waypoint_tform_ko.CopyFrom(se3(-5.0, 0.0))  # odometry began 5 m behind
        snapshot = map_pb2.WaypointSnapshot(id=f"snap{number}")
        link(snapshot.point_cloud.source.transforms_snapshot, "odom", "", se3(0, 0))
        link(snapshot.point_cloud.source.transforms_snapshot, "sensor", "odom", se3(5.0, 0.0))
        snapshot.point_cloud.source.frame_name_sensor = "sensor"
        snapshot.point_cloud.encoding = point_cloud_pb2.PointCloud.ENCODING_XYZ_32F
        floor = [(x, y, -0.5) for x in np.arange(-1, 1, 0.05) for y in np.arange(-1.5, 1.5, 0.05)]
        wall = [(x, 1.0, 0.0) for x in np.arange(-1, 1, 0.05)] if number == 0 else []
        snapshot.point_cloud.data = np.array(floor + wall, dtype="<f4").tobytes()
        if number == 2:
            tag = snapshot.objects.add()
            tag.apriltag_properties.tag_id = 7
            tag.apriltag_properties.frame_name_fiducial = "fiducial_7"
            link(tag.transforms_snapshot, "odom", "", se3(0, 0))
            link(tag.transforms_snapshot, "fiducial_7", "odom", se3(6.0, 0.0))
        file = folder / "waypoint_snapshots" / f"snap{number}"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(snapshot.SerializeToString())
    for a, b, pose in (("id0", "id1", se3(2.0, 0.0, yaw=pi / 2)), ("id1", "id2", se3(3.0, 0.0))):
        edge = graph.edges.add()
        edge.id.from_waypoint, edge.id.to_waypoint = a, b
        edge.from_tform_to.CopyFrom(pose)
    (folder / "graph").write_bytes(graph.SerializeToString())
    return folder


def test_poses_are_chained_along_edges_and_lengths_are_theirs(tmp_path: Path) -> None:
    made = draft_from_graph_nav(write_map(tmp_path))
    stops = {stop.name: (round(stop.pose.x_m, 6), round(stop.pose.y_m, 6)) for stop in made.draft.stops}
    assert stops == {"waypoint_1": (2, 0), "waypoint_2": (2, 3)}
    assert made.draft.stops[1].pose.yaw_rad == pytest.approx(pi / 2)
    assert np.allclose(made.draft.metres, [[0, 2, 5], [2, 0, 3], [5, 3, 0]])
    assert (made.draft.start_waypoint, made.disconnected) == ("id0", ("id3",))


def test_tags_and_points_are_placed_by_the_odometry_of_their_moment(tmp_path: Path) -> None:
    """The tag is 1 m before the last waypoint, which looks along y."""
    draft = draft_from_graph_nav(write_map(tmp_path)).draft
    assert draft.tags == {}, "the map's own: no item's"
    assert draft.other_tags[7] == pytest.approx((2.0, 4.0, 0.0), abs=1e-5)
    assert draft.grid is not None

    def free(x: float, y: float) -> bool:
        assert draft.grid is not None
        return not draft.grid.occupied[draft.grid.cell_at((x, y))]

    assert free(0.0, 0.0)
    assert free(0.0, 0.9)
    assert not free(0.0, 1.02), "the wall"
    assert not free(-2.5, 0.0), "nobody saw it"


def test_waypoints_with_a_name_of_their_own_become_containers_alone(tmp_path: Path) -> None:
    made = draft_from_graph_nav(write_map(tmp_path, names=("waypoint_0", "default", "kitchen counter")))
    assert [(stop.name, stop.waypoint) for stop in made.draft.stops] == [("kitchen_counter", "id2")]
    assert made.named_only


def test_the_draft_is_a_site_that_loads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = write_map(tmp_path / "graph")
    assert lios(["site", "from-graph-nav", str(folder), "-o", str(tmp_path / "home")]) == 0
    told = capsys.readouterr().err
    assert "1 waypoint left out" in told
    assert "Items need other tags than 7" in told
    site = load_site(tmp_path / "home")
    assert site.travel.between(START, LocationId("waypoint_2")) == pytest.approx(5.0)
    assert dict(site.waypoints) == {"start": "id0", "waypoint_1": "id1", "waypoint_2": "id2"}
    assert list(site.tags) == []
    assert "7 at (2.0, 4.0)" in (tmp_path / "home" / "site.yaml").read_text(), "in a comment"
    capsys.readouterr()
    assert lios(["spot", "check", "--site", str(tmp_path / "home"), "--map", str(folder), "--json"]) == 0
    assert lios(["site", "from-graph-nav", str(folder), "-o", str(tmp_path / "home")]) == 2


def test_what_is_no_map_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileMissing):
        draft_from_graph_nav(tmp_path)
    graph = map_pb2.Graph()
    graph.waypoints.add(id="one")
    (tmp_path / "graph").write_bytes(graph.SerializeToString())
    with pytest.raises(NothingToDraft):
        draft_from_graph_nav(tmp_path)


@pytest.mark.skipif(not REAL.exists(), reason="the recorded GraphNav maps are not here")
def test_a_recorded_map_with_an_anchoring(tmp_path: Path) -> None:
    made = draft_from_graph_nav(REAL)
    assert (made.waypoints, made.edges, made.disconnected, dict(made.unread)) == (52, 51, (), {})
    assert made.draft.other_tags[202] == pytest.approx((0, 0, 0), abs=1e-3), "the anchoring's own origin"
    load_site(write_draft(made.draft, tmp_path, name="real"))


def test_damaged_snapshots_are_told_and_what_is_left_becomes_a_draft(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_map(tmp_path / "map", names=("a", "b", "c", "d"))
    snapshots = folder / "waypoint_snapshots"
    (snapshots / "snap0").write_bytes((snapshots / "snap0").read_bytes()[:1000])
    (snapshots / "snap1").write_bytes(b"")
    (snapshots / "snap2").unlink()
    wanted = ["site", "from-graph-nav", str(folder), "-o", str(tmp_path / "home"), "--force"]
    assert lios(wanted) == 3
    told = capsys.readouterr().err
    assert "warning: 2 snapshots are damaged: what the robot saw from id0, id1 is not in the draft." in told
    assert "warning: 1 snapshot is missing: what the robot saw from id2 is" in told
    assert load_site(tmp_path / "home" / "site.yaml").plan.containers
    assert lios([*wanted, "--json"]) == 3
    made = json.loads(capsys.readouterr().out)
    assert made["unread"] == {"id0": "damaged", "id1": "damaged", "id2": "missing"}
    assert made["unread_clouds"] == 3
    assert made["map"] is False
    (folder / "graph").write_bytes(b"")
    assert lios(wanted) == 2


@pytest.mark.parametrize("fault", ["edge", "odometry", "anchor", "twice", "time"])
def test_a_graph_that_no_robot_made_is_refused(
    fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_map(tmp_path / "map")
    graph = map_pb2.Graph.FromString((folder / "graph").read_bytes())
    if fault == "edge":
        graph.edges[0].from_tform_to.position.x = 1e30
    elif fault == "odometry":
        graph.waypoints[1].waypoint_tform_ko.position.y = float("nan")
    elif fault == "anchor":
        graph.anchoring.anchors.add(id="id0").seed_tform_waypoint.rotation.w = float("inf")
    elif fault == "twice":
        graph.waypoints[1].id = graph.waypoints[0].id
    else:
        graph.waypoints[1].annotations.creation_time.seconds = -(10**12)
    (folder / "graph").write_bytes(graph.SerializeToString())
    assert lios(["site", "from-graph-nav", str(folder), "-o", str(tmp_path / "home")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"lios: {folder / 'graph'}: ")
    assert not (tmp_path / "home").exists()
