"""A copy of a log for others: faces blurred, and no picture in it that was not searched."""

from __future__ import annotations

import base64
import io
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from bosdyn.api import image_pb2
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.reader import make_reader
from mcap_protobuf.writer import Writer
from PIL import Image
from test_face_finder import hopper

from replayers.log_tools.faces.blurred_pictures import FaceBlur
from replayers.log_tools.faces.face_finder import Box, FaceFinder
from replayers.mcap_io.messages import Message
from workbench.arrays import Uints8
from workbench.cli import run

pytest.importorskip("cv2", reason="the extra opencv is not installed")
S = 10**9


def jpeg(picture: Uints8) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "JPEG", quality=95)
    return stream.getvalue()


def pixels(data: bytes) -> Uints8:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


FACE = jpeg(hopper())
NOBODY = jpeg(np.tile(np.linspace(0, 255, 64).astype(np.uint8), (48, 1)))


def write_log(path: Path) -> None:
    """Pictures with and without a face in three encodings, one that nobody can search, and what is no picture."""
    with path.open("wb") as stream, Writer(stream) as writer:
        spot = image_pb2.ImageResponse()
        spot.shot.image.data, spot.shot.image.format = FACE, image_pb2.Image.FORMAT_JPEG
        depth = image_pb2.ImageResponse()
        depth.shot.image.data, depth.shot.image.pixel_format = b"\x01\x02", image_pb2.Image.PIXEL_FORMAT_DEPTH_U16
        writer.write_message("/camera/hall", CompressedImage(data=FACE, format="jpeg"), log_time=1 * S)
        writer.write_message("/camera/hall", CompressedImage(data=NOBODY, format="jpeg"), log_time=9 * S)
        writer.write_message("/camera/hall", CompressedImage(data=b"broken", format="jpeg"), log_time=10 * S)
        writer.write_message("/spot/image/hall", spot, log_time=2 * S)
        writer.write_message("/spot/image/depth", depth, log_time=2 * S)
        writer.write_message("/spot/image/bare", image_pb2.ImageResponse(), log_time=2 * S)
        writer.write_message("/tf", FrameTransforms(), log_time=3 * S)
        plain = writer._writer
        schema = plain.register_schema("foxglove.CompressedImage", "jsonschema", b"{}")
        channel = plain.register_channel("/camera/json", "json", schema)
        told = json.dumps({"format": "jpeg", "data": base64.b64encode(FACE).decode(), "frame_id": "eye"}).encode()
        plain.add_message(channel, 4 * S, told, 4 * S)
        schema = plain.register_schema("sensor_msgs/msg/Image", "ros2msg", b"uint8[] data")
        channel = plain.register_channel("/ros/picture", "cdr", schema)
        plain.add_message(channel, 5 * S, b"\x00\x01\x00\x00pixels", 5 * S)
        plain.add_attachment(1, 1, "visit.jpg", "image/jpeg", FACE)
        plain.add_attachment(1, 1, "notes.txt", "text/plain", b"kept")


def contents(path: Path) -> tuple[dict[tuple[str, int], bytes], list[str]]:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        told = {(channel.topic, m.log_time // S): m.data for _, channel, m in reader.iter_messages()}
        return told, [attachment.name for attachment in reader.iter_attachments()]


@pytest.mark.ci
def test_a_copy_for_others_has_no_face_and_nothing_unsearched(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, copy = tmp_path / "run.mcap", tmp_path / "copy.mcap"
    write_log(log)
    assert run(["log", "filter", str(log), "-o", str(copy), "--blur-faces"]) == 0
    said = capsys.readouterr().err
    assert "4 pictures searched, 3 faces found and blurred; screens are not searched for" in said
    assert "/ros/picture: 1 left out" in said
    assert "/camera/hall: 1 left out" in said
    assert "visit.jpg: 1 left out" in said
    (before, _), (after, attached) = contents(log), contents(copy)
    assert attached == ["notes.txt"]
    assert set(before) - set(after) == {("/ros/picture", 5), ("/camera/hall", 10)}
    same = {key for key in after if after[key] == before[key]}
    assert same == {("/camera/hall", 9), ("/spot/image/depth", 2), ("/spot/image/bare", 2), ("/tf", 3)}
    decoded = json.loads(after["/camera/json", 4])
    assert decoded["frame_id"] == "eye"
    hall = CompressedImage.FromString(after["/camera/hall", 1]).data
    for data in (
        image_pb2.ImageResponse.FromString(after["/spot/image/hall", 2]).shot.image.data,
        base64.b64decode(decoded["data"]),
    ):
        assert np.array_equal(pixels(data), pixels(hall))
    assert pixels(hall).shape == hopper().shape
    assert FaceFinder().boxes(pixels(hall)) == ()


def test_without_the_extra_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log, copy = tmp_path / "run.mcap", tmp_path / "copy.mcap"
    write_log(log)
    monkeypatch.setitem(sys.modules, "cv2", None)
    assert run(["log", "filter", str(log), "-o", str(copy), "--blur-faces"]) == 2
    assert "lios-workbench[opencv]" in capsys.readouterr().err
    assert not copy.exists()


def test_a_face_that_flickers_stays_blurred(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blur, found = FaceBlur(), [((40, 50, 60, 70),), (), (), ()]
    monkeypatch.setattr(FaceFinder, "boxes", lambda self, picture: found.pop(0))
    drawn: list[tuple[Box, ...]] = []
    monkeypatch.setattr(FaceFinder, "blurred", lambda self, picture, boxes: drawn.append(boxes) or picture)
    log = tmp_path / "run.mcap"
    write_log(log)
    with log.open("rb") as stream:
        schema, channel, first = next(iter(make_reader(stream).iter_messages(topics=["/camera/hall"])))
    for at_s in (1.0, 1.5, 2.0, 2.5):
        ns = round(at_s * S)
        assert blur.changed(Message(channel, schema, ns, ns, 0, first.data)) is not None
    assert drawn == [((40, 50, 60, 70),)] * 3, "for a second"
