"""Text in pictures: found, level and turned, and no longer readable in a copy of a log."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap.reader import make_reader
from mcap_protobuf.writer import Writer
from PIL import Image, ImageDraw, ImageFont

from replayers.log_tools.faces.text_finder import TextFinder
from workbench.arrays import Uints8
from workbench.cli import run

pytest.importorskip("cv2", reason="the extra opencv is not installed")
SCREEN = (150, 100, 500, 330)


def screen() -> Uints8:
    """A screen with two lines of text on a grey wall; shape (480, 640, 3)."""
    image = Image.new("RGB", (640, 480), (90, 90, 90))
    draw = ImageDraw.Draw(image)
    draw.rectangle(SCREEN, fill=(240, 240, 250))
    for row, line in enumerate(("Dear Alice, your", "password is 1234")):
        draw.text((170, 130 + 50 * row), line, fill=0, font=ImageFont.load_default(28))
    return np.asarray(image)


def png(picture: Uints8) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG")
    return stream.getvalue()


@pytest.fixture
def finder() -> TextFinder:
    pytest.importorskip("rapidocr", reason="the extra text is not installed")
    return TextFinder()


@pytest.mark.parametrize("quarters", [0, 1])
def test_text_on_a_screen_is_found_and_made_coarse(finder: TextFinder, quarters: int) -> None:
    picture = np.ascontiguousarray(np.rot90(screen(), quarters))
    boxes = finder.boxes(picture)
    assert boxes
    covered = np.zeros(picture.shape[:2], dtype=bool)
    for left, top, width, height in boxes:
        covered[top : top + height, left : left + width] = True
    assert covered[picture.max(axis=2) < 20].all(), "every black stroke"
    assert covered.mean() < 0.5, "not the whole picture"
    blurred = finder.blurred(picture, boxes)
    assert not (blurred.max(axis=2) < 20).any(), "no stroke is left"
    assert np.array_equal(blurred[~covered], picture[~covered])


def test_a_picture_without_text_has_none(finder: TextFinder) -> None:
    assert finder.boxes(np.full((480, 640), 90, dtype=np.uint8)) == ()


class _Engine:
    """Stands in for RapidOCR: finds one line where the picture is black, in a picture that is not turned."""

    def __init__(self, **_: object) -> None: ...

    def __call__(self, picture: Uints8, **_: bool) -> SimpleNamespace:
        rows, columns = np.nonzero(picture.max(axis=2) < 20)
        if picture.shape[0] > picture.shape[1] or not len(rows):
            return SimpleNamespace(boxes=None)
        left, top, right, bottom = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
        return SimpleNamespace(boxes=np.array([[[left, top], [right, top], [right, bottom], [left, bottom]]]))


def test_the_text_in_a_copy_of_a_log_is_blurred_and_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rapidocr", SimpleNamespace(RapidOCR=_Engine))
    monkeypatch.setitem(sys.modules, "onnxruntime", SimpleNamespace())
    log, copy = tmp_path / "run.mcap", tmp_path / "copy.mcap"
    blank = png(np.full((480, 640, 3), 90, dtype=np.uint8))
    with log.open("wb") as stream, Writer(stream) as writer:
        for stamp, data in ((1, blank), (2 * 10**9, png(screen()))):
            writer.write_message("/camera/hall", CompressedImage(data=data, format="png"), stamp, stamp)
    assert run(["log", "filter", str(log), "-o", str(copy), "--blur-text"]) == 0
    said = capsys.readouterr().err
    assert "2 pictures searched, 1 pieces of text found and blurred; pictures on screens" in said
    with copy.open("rb") as stream:
        data = [CompressedImage.FromString(m.data).data for _, _, m in make_reader(stream).iter_messages()]
    assert data[0] == blank, "byte for byte"
    assert (np.asarray(Image.open(io.BytesIO(data[1]))).max(axis=2) < 20).sum() == 0, "no black stroke is left"


def test_without_the_extra_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rapidocr", None)
    log, copy = tmp_path / "run.mcap", tmp_path / "copy.mcap"
    with log.open("wb") as stream, Writer(stream) as writer:
        writer.write_message("/camera/hall", CompressedImage(data=png(screen()), format="png"), 1, 1)
    assert run(["log", "filter", str(log), "-o", str(copy), "--blur-text"]) == 2
    assert "lios-workbench[text]" in capsys.readouterr().err
    assert not copy.exists()
