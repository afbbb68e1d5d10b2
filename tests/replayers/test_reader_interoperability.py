"""Third-party libraries read our logs, and ROS 2 bags that passed our tools are still valid bags."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from sample_logs import write_toy_log
from toy import COUNTER

from replayers.mcap_io.reader import messages
from workbench import cli

NPM_PACKAGES = ("@mcap/core@2", "@mcap/nodejs@1", "@mcap/support@1", "@foxglove/schemas@2", "protobufjs@7")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = write_toy_log(tmp_path_factory.mktemp("other") / "a.mcap")
    assert cli.run(["log", "note", str(path), "seen elsewhere", "--at", "3"]) == 0
    return path


def _topics(path: Path) -> dict[str, int]:
    counts: dict[str, int] = {}
    for message in messages(path):
        counts[message.topic] = counts.get(message.topic, 0) + 1
    return counts


def test_the_foxglove_sdk_has_the_same_schemas(log: Path):
    foxglove = pytest.importorskip("foxglove.messages")
    schemas = {m.schema.name: m.schema for m in messages(log) if m.schema and m.schema.encoding == "protobuf"}
    assert len(schemas) == 7
    for name, schema in schemas.items():
        theirs = getattr(foxglove, name.removeprefix("foxglove.")).get_schema()
        assert theirs.name == name
        assert theirs.encoding == "protobuf"
        assert _fields(theirs.data) == _fields(schema.data), name


def _fields(data: bytes) -> dict[str, dict[int, tuple[str, int, str]]]:
    """Number, name and type of every field of every message that a set of descriptors describes."""
    found: dict[str, dict[int, tuple[str, int, str]]] = {}
    for file in FileDescriptorSet.FromString(data).file:
        for message in file.message_type:
            found[f"{file.package}.{message.name}"] = {
                field.number: (field.name, field.type, field.type_name) for field in message.field
            }
    return {name: fields for name, fields in found.items() if name.startswith("foxglove.")}


def test_the_foxglove_sdk_writes_the_same_bytes_for_the_same_pose(log: Path):
    foxglove = pytest.importorskip("foxglove.messages")
    first = next(m for m in messages(log, topics="/robot/pose".__eq__))
    pose = foxglove.Pose(
        position=foxglove.Vector3(x=1.0, y=2.0, z=0.0), orientation=foxglove.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    )
    theirs = foxglove.PoseInFrame(timestamp=foxglove.Timestamp(1_767_225_600, 0), frame_id="map", pose=pose)
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

    assert PoseInFrame.FromString(theirs.encode()) == PoseInFrame.FromString(first.data)


def test_rerun_checks_and_loads_it(log: Path, tmp_path: Path):
    pytest.importorskip("rerun")
    rerun = Path(sys.executable).with_name("rerun")
    environment = {**os.environ, "HOME": str(tmp_path), "RERUN_ANALYTICS_ENABLED": "false"}

    def run(*args: str | Path) -> str:
        command = [str(rerun), *map(str, args)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, timeout=120)
        return done.stdout + done.stderr

    checked = run("mcap", "check", log)
    rows = [line for line in checked.splitlines() if line.startswith("ok")]
    assert len(rows) == len(_topics(log))
    run("mcap", "convert", log, "-o", tmp_path / "a.rrd")
    told = run("rrd", "stats", tmp_path / "a.rrd")
    assert all(topic in told for topic in ("/robot/pose", "/tf", "/log", "/search/plan"))


def test_a_ros2_bag_that_passed_through_our_tools_is_still_one(tmp_path: Path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.rosbag2.enums import StoragePlugin
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    text = store.types["std_msgs/msg/String"]
    with rosbag2.Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/words", "std_msgs/msg/String", typestore=store)
        for i in range(5):
            writer.write(connection, i + 1, store.serialize_cdr(text(data=f"word {i}"), "std_msgs/msg/String"))
    (bag,) = (tmp_path / "bag").glob("*.mcap")
    for command in (["log", "filter"], ["log", "merge"], ["recover"], ["log", "compact"]):
        out = tmp_path / f"{command[-1]}.mcap"
        assert cli.run([*command, str(bag), "-o", str(out)]) == 0
        reader = McapReader(out)
        reader.open()
        found = [
            (connection.topic, stamp, store.deserialize_cdr(bytes(data), "std_msgs/msg/String").data)
            for connection, stamp, data in reader.messages(reader.connections)
        ]
        reader.close()
        assert found == [("/words", i + 1, f"word {i}") for i in range(5)]


def test_cat_decodes_ros2_messages(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    writers = pytest.importorskip("mcap_ros2.writer")
    path = tmp_path / "bag.mcap"
    with open(path, "wb") as stream:
        writer = writers.Writer(stream)
        schema = writer.register_msgdef("std_msgs/msg/String", "string data")
        writer.write_message("/words", schema, {"data": "hello"}, log_time=1, publish_time=1)
        writer.finish()
    assert cli.run(["log", "cat", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["data"] == {"data": "hello"}


@pytest.fixture(scope="module")
def node_modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with npm's MCAP packages; LIOS_NODE_MODULES names one that is there already."""
    ready = os.environ.get("LIOS_NODE_MODULES")
    if ready:
        return Path(ready)
    if not (shutil.which("npm") and shutil.which("node")):
        pytest.skip("no node and npm here")
    folder = tmp_path_factory.mktemp("npm")
    command = ["npm", "install", "--no-audit", "--no-fund", "--ignore-scripts", *NPM_PACKAGES]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=240)
    if done.returncode:
        pytest.skip(f"npm cannot install @mcap/core here: {done.stderr.strip().splitlines()[-1:]}")
    return folder / "node_modules"


@pytest.mark.slow
def test_npm_mcap_core_reads_every_message_with_the_published_schemas(log: Path, node_modules: Path):
    script = node_modules.parent / "read_mcap.mjs"
    shutil.copy(Path(__file__).with_name("read_mcap.mjs"), script)
    command = ["node", str(script), str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["counts"] == _topics(log)
    assert told["streamed"] == sum(_topics(log).values())
    assert told["done"]
    assert told["outcome"]["cost"] == 11
    assert f"container/{COUNTER}" in told["scene"]
    assert set(told["attachments"]) == {"place.json", "task.json", "settings.json"}
    assert set(told["metadata"]) == {"lios.run", "lios.outcome"}
    assert told["unpublished"] == ["foxglove.Event"], "published for protobuf, not yet in the npm package"
    assert told["unknownFields"] == 0
