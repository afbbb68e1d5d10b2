"""Messages of any type are shown, and one that cannot be decoded does not end a command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from recorders.mcap_io.channels import protobuf_channel
from recorders.mcap_io.writer import McapWriter
from workbench import cli


def _cat(log: Path, capsys: pytest.CaptureFixture[str]) -> list[object]:
    assert cli.run(["log", "cat", str(log), "--json"]) == 0
    return [json.loads(line)["data"] for line in capsys.readouterr().out.splitlines()]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """An empty ROS message, two broken schemas, a protobuf schema without its import, and a message of zeros."""
    spec = protobuf_channel("/pose", PoseInFrame)
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    files = FileDescriptorSet.FromString(spec.schema_data)
    for file in files.file:
        if not file.name.endswith("PoseInFrame.proto"):
            file.Clear()
    alone = FileDescriptorSet(file=[file for file in files.file if file.name])
    with McapWriter(tmp_path / "a.mcap") as writer:
        for name, encoding, schema, topic, message, data in (
            ("std_msgs/msg/Empty", "ros2msg", b"", "/ping", "cdr", b"\0\1\0\0\0"),
            ("a/msg/B", "ros2msg", b"this is [no] definition\x00", "/bad", "cdr", b"\0\1\0\0\0"),
            ("a.B", "protobuf", b"\xff\xff", "/rubbish", "protobuf", b"\xff"),
            (spec.schema_name, "protobuf", alone.SerializeToString(), "/alone", "protobuf", b""),
            (spec.schema_name, spec.schema_encoding, spec.schema_data, "/pose", "protobuf", _zeros()),
        ):
            channel = writer.add_channel(topic, message, writer.add_schema(name, encoding, schema))
            writer.add_message(channel, data, log_time=1)
    return tmp_path / "a.mcap"


def _zeros() -> bytes:
    pose = PoseInFrame()
    pose.pose.position.x = 0.0
    pose.pose.orientation.SetInParent()
    return pose.SerializeToString()


def test_one_bad_type_does_not_end_a_command(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    empty, bad, rubbish, alone, pose = _cat(log, capsys)
    assert empty == {}
    for shown in (bad, rubbish, alone):
        assert isinstance(shown, dict)
        assert "undecodable" in shown, shown
    assert isinstance(pose, dict)
    assert cli.run(["log", "convert", str(log), "-o", str(tmp_path / "a.jsonl")]) == 0
    assert len((tmp_path / "a.jsonl").read_text().splitlines()) == 5


def test_fields_that_are_zero_are_shown_as_zero(log: Path, capsys: pytest.CaptureFixture[str]):
    pose = _cat(log, capsys)[-1]
    assert isinstance(pose, dict)
    assert pose["frame_id"] == ""
    assert pose["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}


def test_messages_in_other_encapsulations_are_named_and_not_misread(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """In XCDR2 a float64 stands on a multiple of four bytes; read as plain CDR, the long message would give 0.0."""
    fields = b"\x07\0\0\0" + b"\0\0\0\0\0\0\x04\x40" + bytes(8)
    with McapWriter(tmp_path / "a.mcap") as writer:
        channel = writer.add_channel("/d", "cdr", writer.add_schema("odd/msg/D", "ros2msg", b"int32 n\nfloat64 x\n"))
        for head in (b"\0\x07\0\0", b"\0\x09\0\0", b"\0\x03\0\0", b"\x01\x01\0\0", b"\0"):
            writer.add_message(channel, head + fields * (len(head) > 1), log_time=1)
        writer.add_message(channel, b"\0\x01\0\0\x07\0\0\0" + bytes(4) + b"\0\0\0\0\0\0\x04\x40", log_time=1)
        wide = writer.add_channel("/w", "cdr", writer.add_schema("odd/msg/W", "ros2msg", b"wstring name\n"))
        writer.add_message(wide, b"\0\x01\0\0\x01\0\0\0K\0", log_time=1)
    *others, plain, wide = _cat(tmp_path / "a.mcap", capsys)
    reasons = [other["undecodable"] for other in others]  # pyright: ignore
    for reason, name in zip(reasons, ("XCDR2 (0x0007)", "XCDR2, delimited (0x0009)", "parameter lists", "unknown", "1 bytes"), strict=True):  # fmt: skip # noqa: E501
        assert name in reason, reason
    assert plain == {"n": 7, "x": 2.5}
    assert "wstring" in wide["undecodable"]  # pyright: ignore
