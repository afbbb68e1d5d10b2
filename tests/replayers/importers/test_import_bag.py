"""Bags of ROS 1 and ROS 2 become runs; files that are not bags, are empty, or lack tf give one clear line."""

from __future__ import annotations

import sqlite3
import sys
from contextlib import closing
from pathlib import Path

import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin

from recorders.spot.run.site_tasks import delivery_of, site_task
from replayers.importers.bag_survey import RobotNotLocated
from replayers.importers.bags import EmptyBag, NotABag, UnknownMessageType, open_bag
from replayers.importers.import_bag import ImportPlan, ImportReport, import_bag
from replayers.importers.mapping import load_mapping, presets
from replayers.runs.run import Run, read
from workbench.errors import FileMissing, MalformedFile, UnknownName
from workbench.worlds.sites.site import Site, load_site

sys.path.insert(0, str(Path(__file__).parent))
from bag_writing import Ros1Bag, Ros2Bag


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site("paper_home")


def imported(
    bag: Path, site: Site, output: Path, mapping: str = "auto", strategy: str = ""
) -> tuple[ImportReport, Run]:
    with open_bag(bag) as opened:
        plan = ImportPlan(
            site=site,
            mapping=load_mapping(mapping, opened.topics),
            task=site_task(delivery_of(site), site),
            strategy=strategy,
            estimator="counts",
        )
        report = import_bag(opened, plan, output)
    return report, read(output)


def did(run: Run) -> list[tuple[str, str]]:
    return [(action.action, action.target) for action in run.actions]


TRIP = [
    ("move", "countertop"),
    ("search", "countertop"),
    ("move", "dining_table"),
    ("search", "dining_table"),
    ("pick", "dining_table"),
    ("move", "bed"),
    ("search", "bed"),
    ("place", "bed"),
]
"""What the robot of bag_writing.trip does."""


def test_the_papers_stack_on_ros_1(site: Site, tmp_path: Path) -> None:
    bag = tmp_path / "trial.bag"
    Ros1Bag(bag).write(site)
    report, run = imported(bag, site, tmp_path / "trial.mcap")
    assert did(run) == TRIP
    seen = {o.container: [item.type for item in o.items] for o in run.observations}
    assert seen == {"countertop": ["WaterBottle"], "dining_table": ["CellPhone"], "bed": []}
    assert run.outcome is not None
    assert run.outcome.status == "done", run.outcome.reason
    assert run.info.source == "import"
    assert report.unmapped == ("/rosout_agg",)
    moved = [action for action in run.actions if action.action == "move"]
    costs = [site.travel.between(a.origin, a.target) for a in moved]
    assert [a.travel_m for a in moved] == pytest.approx(costs, abs=0.8)


def test_without_goals_and_results_moves_are_told_by_standing_still(site: Site, tmp_path: Path) -> None:
    bag = tmp_path / "quiet.bag"
    Ros1Bag(bag).write(site, goals=False)
    mapping = tmp_path / "mapping.yaml"
    text = (
        presets()["paper"].read_text().replace('results: ["/move_base/result", "*/move_base/result"]', "results: []")
    )
    mapping.write_text(text)
    _, run = imported(bag, site, tmp_path / "quiet.mcap", str(mapping))
    assert did(run) == TRIP


@pytest.mark.parametrize("plugin", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_spot_ros2_and_nav2(site: Site, tmp_path: Path, plugin: StoragePlugin) -> None:
    bag = tmp_path / "rosbag2"
    Ros2Bag(bag, plugin).write(site)
    report, run = imported(bag, site, tmp_path / "run.mcap")
    assert [step for step in did(run) if step[0] in ("move", "search")] == [
        s for s in TRIP if s[0] in ("move", "search")
    ]
    assert report.messages["images"] > 0
    topics = topics_of(run.path)
    assert {"/tf", "/robot/pose", "/robot/odometry", "/map", "/camera/spot/frontleft"} <= topics


def test_beliefs_and_plans_are_computed_after_the_fact_and_marked(site: Site, tmp_path: Path) -> None:
    bag = tmp_path / "trial.bag"
    Ros1Bag(bag).write(site)
    _, run = imported(bag, site, tmp_path / "trial.mcap", strategy="model-lios")
    assert len(run.plans) == 1 + len(run.observations)
    assert {plan.reason for plan in run.plans} == {"computed after the fact"}
    assert [plan.decision for plan in run.plans] == list(range(1, len(run.plans) + 1))
    assert len(run.beliefs) == len(run.plans)


def test_a_bag_without_tf_and_pose_says_so_and_leaves_no_log(site: Site, tmp_path: Path) -> None:
    bag = tmp_path / "nowhere.bag"
    Ros1Bag(bag).write(site, tf=False)
    with pytest.raises(RobotNotLocated, match="no tf from map to base_link"):
        imported(bag, site, tmp_path / "nowhere.mcap")
    assert not (tmp_path / "nowhere.mcap").exists()


def test_what_is_no_bag_or_empty(site: Site, tmp_path: Path) -> None:
    (tmp_path / "notes.bag").write_bytes(b"these are notes, no bag")
    (tmp_path / "notes.txt").write_text("notes")
    (tmp_path / "folder").mkdir()
    with Writer1(tmp_path / "empty.bag"):
        pass
    for name, error in (
        ("notes.bag", NotABag),
        ("notes.txt", NotABag),
        ("folder", NotABag),
        ("empty.bag", EmptyBag),
        ("missing.bag", FileMissing),
    ):
        with pytest.raises(error) as caught, open_bag(tmp_path / name):
            pass
        assert name in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_cut_off_bag_is_one_line(site: Site, tmp_path: Path) -> None:
    bag = tmp_path / "trial.bag"
    Ros1Bag(bag).write(site)
    data = bag.read_bytes()
    for share in (0.2, 0.6, 0.95):
        cut = tmp_path / f"cut{share}.bag"
        cut.write_bytes(data[: int(len(data) * share)])
        with pytest.raises((NotABag, RobotNotLocated)) as caught:
            imported(cut, site, tmp_path / f"cut{share}.mcap")
        assert "\n" not in str(caught.value)


def test_a_type_that_nobody_defines(site: Site, tmp_path: Path) -> None:
    """SQLite bags of ROS 2 Humble and before carry no definitions."""
    bag = tmp_path / "rosbag2"
    Ros2Bag(bag, StoragePlugin.SQLITE3, version=8).write(site, unheard=True)
    with closing(sqlite3.connect(bag / "rosbag2.db3")) as base:
        base.execute("DELETE FROM message_definitions")
        base.commit()
    mapping = load_mapping("spot_ros2", ())
    said = "/apriltag/detections has type odd_msgs/msg/Unheard"
    with open_bag(bag) as opened, pytest.raises(UnknownMessageType, match=said):
        list(opened.messages(tuple(t for t in opened.topics if mapping.role_of(t) == "markers")))


def test_mappings_are_checked(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("lios_bag_mapping: 1\nname: x\ntopics: {wheels: [/a]}\n")
    with pytest.raises(MalformedFile, match="unknown roles wheels"):
        load_mapping(str(wrong), ())
    wrong.write_text('lios_bag_mapping: 1\nname: x\ntopics: {}\ntag_frames: ["fiducial"]\n')
    with pytest.raises(MalformedFile, match="has no group"):
        load_mapping(str(wrong), ())
    with pytest.raises(UnknownName, match="paper"):
        load_mapping("papr", ())
    assert load_mapping("auto", ("/move_base/goal", "/ar_pose_marker", "/tf")).name == "paper"
    assert load_mapping("auto", ("/spot/odometry", "/spot/camera/left/image", "/goal_pose")).name == "spot_ros2"
    assert load_mapping("spot_ros2", ()).tag_of("filtered_fiducial_12") == 12


def topics_of(path: Path) -> set[str]:
    from mcap.reader import make_reader

    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return {channel.topic for channel in summary.channels.values()}
