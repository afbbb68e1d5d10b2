"""SQLite bags are read by what is in their files, whatever their metadata.yaml says, also after a killed recorder."""

from __future__ import annotations

import json
import shutil
import sqlite3
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml
import zstandard
from rosbags.rosbag2 import StoragePlugin

from replayers.importers.bags import NotABag, open_bag
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.worlds.sites.site import load_site

sys.path.insert(0, str(Path(__file__).parent))
from standing_bag import Standing, StandingBag

COUNTS = {"/ar_pose_marker": 75, "/tf": 75, "/tf_static": 1}
NEW_QOS = {
    "history": "keep_last",
    "depth": 1,
    "reliability": "reliable",
    "durability": "transient_local",
    "deadline": {"sec": 0, "nsec": 0},
    "lifespan": {"sec": 0, "nsec": 0},
    "liveliness": "automatic",
    "liveliness_lease_duration": {"sec": 0, "nsec": 0},
    "avoid_ros_namespace_conventions": False,
}
OLD_QOS = "- history: 3\n  depth: 0\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 2147\n    nsec: 1\n"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a robot that stands at the countertop, and sees a bottle on it."""
    folder = tmp_path_factory.mktemp("bag") / "bag"
    return StandingBag(folder, Standing(ros2=True), storage=StoragePlugin.SQLITE3).write(load_site("paper_home"))


def with_metadata(source: Path, target: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """A copy of a bag whose metadata.yaml says something else."""
    shutil.copytree(source, target)
    file = target / "metadata.yaml"
    metadata = yaml.safe_load(file.read_text())
    change(metadata["rosbag2_bagfile_information"])
    file.write_text(yaml.safe_dump(metadata))
    return target


def with_qos(qos: object) -> Callable[[dict[str, Any]], object]:
    def change(about: dict[str, Any]) -> None:
        for topic in about["topics_with_message_count"]:
            topic["topic_metadata"]["offered_qos_profiles"] = qos

    return change


def assert_whole(bag: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The bag's import holds every message and the bottle."""
    log = folder / "log.mcap"
    command = ["import", str(bag), "--site", "paper_home", "-m", "paper", "-s", "none", "-o", str(log), "--json"]
    assert lios(command) == 0
    assert json.loads(capsys.readouterr().out)["detections"]["placed"] == 75
    assert {o.container: [i.type for i in o.items] for o in read(log).observations} == {"countertop": ["WaterBottle"]}


@pytest.mark.ci_but(3)
@pytest.mark.parametrize(
    "change",
    [
        with_qos([NEW_QOS]),
        with_qos(OLD_QOS),
        with_qos("nonsense: ["),
        with_qos([{"durability": "best_available"}]),
        lambda about: about.update(version=99),
        lambda about: about.update(message_count=0),
        lambda about: about.update(topics_with_message_count=[]),
        lambda about: about.update(relative_file_paths=["gone.db3"]),
        lambda about: about.update(relative_file_paths="bag.db3", storage_identifier=7),
        lambda about: about.clear(),
    ],
    ids=["new QoS", "old QoS", "no QoS", "short QoS", "version", "count", "topics", "files", "types", "empty"],
)
def test_metadata_that_differs_from_the_file_loses_nothing(
    recorded: Path,
    tmp_path: Path,
    change: Callable[[dict[str, Any]], object],
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert_whole(with_metadata(recorded, tmp_path / "bag", change), tmp_path, capsys)


def test_a_folder_and_a_file_without_metadata_are_read(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "alone").mkdir()
    shutil.copy(recorded / "bag.db3", tmp_path / "alone")
    for number, bag in enumerate((tmp_path / "alone", tmp_path / "alone" / "bag.db3")):
        (tmp_path / str(number)).mkdir()
        assert_whole(bag, tmp_path / str(number), capsys)


@pytest.mark.parametrize("listed", [True, False])
def test_files_that_overlap_in_time_are_merged_and_others_of_the_folder_left_out(
    recorded: Path, tmp_path: Path, listed: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """Topics are split over the files; detections, of the first, come before transforms of the same time."""
    folder = tmp_path / "split"
    shutil.copytree(recorded, folder)
    for name, topics in (("a.db3", "('/ar_pose_marker')"), ("b.db3", "('/tf', '/tf_static')")):
        shutil.copy(recorded / "bag.db3", folder / name)
        with closing(sqlite3.connect(folder / name)) as base:
            base.execute(f"DELETE FROM messages WHERE topic_id NOT IN (SELECT id FROM topics WHERE name IN {topics})")
            base.execute(f"DELETE FROM topics WHERE name NOT IN {topics}")
            base.commit()
    if listed:
        metadata = yaml.safe_load((folder / "metadata.yaml").read_text())
        metadata["rosbag2_bagfile_information"]["relative_file_paths"] = ["a.db3", "b.db3"]
        (folder / "metadata.yaml").write_text(yaml.safe_dump(metadata))
    else:
        (folder / "metadata.yaml").unlink()
        (folder / "bag.db3").unlink()
    with open_bag(folder) as opened:
        assert opened.counts == COUNTS
        stamps = [message.stamp_ns for message in opened.messages(opened.topics)]
    assert stamps == sorted(stamps)
    assert_whole(folder, tmp_path, capsys)


def test_what_a_killed_recorder_left_in_its_write_ahead_log_is_read(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    live, killed = tmp_path / "live.db3", tmp_path / "killed"
    killed.mkdir()
    shutil.copy(recorded / "bag.db3", live)
    with closing(sqlite3.connect(live)) as base:
        base.execute("PRAGMA journal_mode = WAL")
        base.execute("PRAGMA wal_autocheckpoint = 0")
        rows = base.execute("SELECT * FROM messages WHERE topic_id = 3").fetchall()
        base.execute("DELETE FROM messages WHERE topic_id = 3")
        base.commit()
        base.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        base.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        base.commit()
        for ending in ("", "-wal"):
            shutil.copy(tmp_path / f"live.db3{ending}", killed / f"bag_0.db3{ending}")
    before = (killed / "bag_0.db3").read_bytes()
    assert_whole(killed, tmp_path, capsys)
    assert sorted(path.name for path in killed.iterdir()) == ["bag_0.db3", "bag_0.db3-wal"]
    assert (killed / "bag_0.db3").read_bytes() == before


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_bags_compressed_by_file_or_by_message_are_read(
    tmp_path: Path, storage: StoragePlugin, capsys: pytest.CaptureFixture[str]
) -> None:
    plain = StandingBag(tmp_path / "plain", Standing(ros2=True), storage=storage).write(load_site("paper_home"))
    (data,) = [path for path in plain.iterdir() if path.name != "metadata.yaml"]

    def by_file(about: dict[str, Any]) -> None:
        about.update(compression_mode="FILE", compression_format="zstd", relative_file_paths=[f"{data.name}.zstd"])

    packed = with_metadata(plain, tmp_path / "packed", by_file)
    (packed / data.name).unlink()
    (packed / f"{data.name}.zstd").write_bytes(zstandard.compress(data.read_bytes()))
    assert_whole(packed, tmp_path, capsys)
    by_message = StandingBag(tmp_path / "each", Standing(ros2=True), storage=storage, packed=True)
    (tmp_path / "2").mkdir()
    assert_whole(by_message.write(load_site("paper_home")), tmp_path / "2", capsys)


def test_damaged_databases_are_one_line(recorded: Path, tmp_path: Path) -> None:
    data = (recorded / "bag.db3").read_bytes()
    odd = {
        "cut.db3": data[: len(data) // 2],
        "zeros.db3": data[:5000] + bytes(len(data) - 5000),
        "text.db3": b"this is text",
        "other.db3": b"",
    }
    for name, content in odd.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(NotABag) as caught, open_bag(tmp_path / name) as opened:
            list(opened.messages(opened.topics))
        assert "\n" not in str(caught.value), name


def test_a_topic_that_cannot_be_decoded_is_skipped_and_told(recorded: Path, tmp_path: Path) -> None:
    bag = tmp_path / "odd.db3"
    shutil.copy(recorded / "bag.db3", bag)
    with closing(sqlite3.connect(bag)) as base:
        columns = [row[1] for row in base.execute("PRAGMA table_info(topics)")]
        first = dict(zip(columns, base.execute("SELECT * FROM topics").fetchone(), strict=True))
        for number, (topic, kind, encoding) in enumerate(
            (("/events", "odd_msgs/msg/Event", "cdr"), ("/pb", "odd.Pb", "protobuf")), start=50
        ):
            row = first | {"id": number, "name": topic, "type": kind, "serialization_format": encoding}
            base.execute(f"INSERT INTO topics VALUES ({', '.join('?' * len(columns))})", list(row.values()))
            base.execute("INSERT INTO messages VALUES (?, ?, ?, ?)", (number * 1000, number, 1, b"x"))
        base.commit()
    with open_bag(bag) as opened:
        assert opened.counts == COUNTS
        assert "defined neither in the bag nor in ROS 2" in opened.skipped["/events"]
        assert "protobuf" in opened.skipped["/pb"]
        assert len(list(opened.messages(tuple(COUNTS)))) == 151
