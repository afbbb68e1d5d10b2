"""Screens by an ONNX file of the user's: networks whose one box can be computed by hand, in both known layouts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replayers.log_tools.faces.screens.onnx_model import (
    constant,
    input_shape,
    model,
    operator,
    tensor_type,
    unmade_input,
)
from replayers.log_tools.faces.screens.screen_finder import ScreenFinder
from replayers.log_tools.faces.screens.yolo import UnknownModel, Yolo
from workbench.arrays import Floats, Uints8
from workbench.cli import run

cv2 = pytest.importorskip("cv2", reason="the extra opencv is not installed")
SIDE, CELLS = 64, 64 + 16 + 4
LAPTOP, CAT = 63, 15
LOG = Path(__file__).parents[2] / "logs" / "breakfast.mcap"


def network(path: Path, values: Floats, *, seen: tuple[int, ...], share: float = 1.0, side: int = SIDE) -> Path:
    """A network that answers the same values whatever it is given, but one: it is the mean of the first channel.

    Args:
        seen: the place of that one. share: by what the mean is multiplied.
    """
    weights = np.zeros((values.size, 3, 1, 1))
    weights[np.ravel_multi_index(seen, values.shape), 0] = share
    constants = [
        constant("weights", weights),
        constant("bias", values.reshape(-1)),
        constant("shape", np.array(values.shape)),
    ]
    operators = [
        operator("GlobalAveragePool", ["images"], "mean"),
        operator("Conv", ["mean", "weights", "bias"], "flat", {"kernel_shape": (1, 1)}),
        operator("Reshape", ["flat", "shape"], "output"),
    ]
    given = tensor_type("images", (1, 3, side, side))
    path.write_bytes(model(operators, constants, given, [tensor_type("output", values.shape)]))
    return path


def yolov8(path: Path, kind: int = LAPTOP) -> Path:
    """One box around (16, 8), 8 by 4 pixels, as likely as the picture is red."""
    values = np.zeros((1, 84, 5))
    values[0, :4, 2] = 16, 8, 8, 4
    return network(path, values, seen=(0, 4 + kind, 2))


def yolox(path: Path) -> Path:
    """One box in the cell of column 2 and row 1 of the grid of 16 pixels, as likely as the picture is blue."""
    values = np.zeros((1, CELLS, 85))
    values[0, 64 + 4 + 2, :5] = 0.5, 0.25, np.log(1.5), np.log(0.5), 1.0
    return network(path, values, seen=(0, 64 + 4 + 2, 5 + LAPTOP), share=1 / 255)


def plain(red: int, blue: int, shape: tuple[int, int] = (SIDE, SIDE)) -> Uints8:
    return np.tile(np.array([red, 0, blue], dtype=np.uint8), (*shape, 1))


def test_a_box_of_yolov8_is_where_its_numbers_say(tmp_path: Path) -> None:
    find = Yolo(cv2, yolov8(tmp_path / "v8.onnx"))
    assert find(plain(255, 0)) == [(12, 6, 8, 4)]
    assert find(plain(0, 255)) == [], "the first channel is red"
    assert find(plain(255, 0, (32, 128))) == [(24, 12, 16, 8)], "half as large, at the top of what the network sees"
    assert Yolo(cv2, yolov8(tmp_path / "cat.onnx", CAT))(plain(255, 0)) == [], "no screen"


def test_a_box_of_yolox_is_where_its_numbers_say(tmp_path: Path) -> None:
    find = Yolo(cv2, yolox(tmp_path / "x.onnx"))
    middle, size = (2.5 * 16, 1.25 * 16), (1.5 * 16, 0.5 * 16)
    assert find(plain(0, 255)) == [(middle[0] - size[0] / 2, middle[1] - size[1] / 2, *size)]
    assert find(plain(255, 0)) == [], "the first channel is blue"
    assert find(plain(0, 20)) == [], "a score below a tenth"


def test_a_box_beyond_the_edge_ends_there(tmp_path: Path) -> None:
    values = np.zeros((1, 84, 5))
    values[0, :4, 2] = 2, 62, 10, 10
    find = Yolo(cv2, network(tmp_path / "edge.onnx", values, seen=(0, 4 + LAPTOP, 2)))
    assert find(plain(255, 0)) == [(0, 57, 7, 7)]


def test_a_screen_is_found_in_every_turn(tmp_path: Path) -> None:
    boxes = ScreenFinder(yolov8(tmp_path / "v8.onnx")).boxes(plain(255, 0))
    middles = sorted((left + width / 2, top + height / 2) for left, top, width, height in boxes)
    assert np.allclose(middles, [(8, 48), (16, 8), (48, 56), (56, 16)], atol=1), "(16, 8), turned by quarters"


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "cannot be read as ONNX (no input)"),
        (b"nothing of the kind", "cannot be read as ONNX"),
        (model([], [], tensor_type("images", (1, 3, 64, 32)), []), "not a square picture"),
        (model([], [], tensor_type("images", (1, 8)), []), "not a square picture"),
        (model([], [], tensor_type("images", (1, 3, 2**30, 2**30)), []), "of at most 4096 pixels"),
    ],
)
def test_what_is_no_detector_is_told(tmp_path: Path, data: bytes, said: str) -> None:
    path = tmp_path / "model.onnx"
    path.write_bytes(data)
    with pytest.raises(UnknownModel) as caught:
        Yolo(cv2, path)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


IMAGES, OUT = tensor_type("images", (1, 3, SIDE, SIDE)), tensor_type("out", (1, 3, SIDE, SIDE))
CONV, RELU = operator("Conv", ["images", "w"], "made"), operator("Relu", ["made"], "out")
CONV_WEIGHTS = constant("w", np.zeros((3, 3, 1, 1)))


def branch(taken: str) -> bytes:
    """A node with a graph in it, whose one node takes a name: shorter than 128 bytes, so that sizes are one byte."""
    graph = operator("Relu", [taken], "in_branch")
    graph = bytes([0x0A, len(graph)]) + graph
    told = bytes([0x32, len(graph)]) + graph
    return operator("If", ["images"], "made") + bytes([0x2A, len(told)]) + told


@pytest.mark.parametrize(
    ("nodes", "constants", "unmade"),
    [
        ([CONV, RELU], [CONV_WEIGHTS], None),
        ([CONV, RELU], [], "w"),
        ([RELU, CONV], [CONV_WEIGHTS], "made"),
        ([operator("Relu", ["out"], "out")], [], "out"),
        ([operator("Constant", [], "w"), CONV, RELU], [], None),
        ([operator("Clip", ["images", "", "most"], "out")], [constant("most", np.array(1.0))], None),
        ([operator("Relu", ["two\nlines"], "out")], [], "two\nlines"),
        ([branch("images"), RELU], [], None),
        ([branch("made"), RELU], [], "made"),
    ],
)
def test_a_node_that_takes_what_nothing_makes_is_never_given_to_opencv(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, nodes: list[bytes], constants: list[bytes], unmade: str | None
) -> None:
    """OpenCV ends the process on such a model."""
    path = tmp_path / "model.onnx"
    path.write_bytes(model(nodes, constants, IMAGES, [OUT]))
    assert unmade_input(path.read_bytes()) == unmade

    def loaded(_: object) -> None:
        raise AssertionError("it was given to OpenCV")

    monkeypatch.setattr(cv2.dnn, "readNetFromONNX", loaded)
    if unmade is None:
        with pytest.raises(AssertionError, match="given to OpenCV"):
            Yolo(cv2, path)
        return
    with pytest.raises(UnknownModel) as caught:
        Yolo(cv2, path)
    assert f"a node takes {unmade!r}, which nothing before it makes" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_graphs_too_deep_in_each_other_are_told() -> None:
    deep = b""
    for _ in range(100):
        for field in (6, 5, 1):
            deep = bytes([field << 3 | 2]) + size(deep) + deep
    with pytest.raises(ValueError, match="graphs in graphs"):
        unmade_input(bytes([7 << 3 | 2]) + size(deep) + deep)


def size(data: bytes) -> bytes:
    """The length of less than 16 kB as a varint of two bytes."""
    return bytes([len(data) & 0x7F | 0x80, len(data) >> 7])


def test_an_output_of_another_shape_is_told_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = network(tmp_path / "other.onnx", np.zeros((1, 10, 6)), seen=(0, 0, 0))
    words = ["log", "filter", str(LOG), "-o", str(tmp_path / "copy.mcap"), "--blur-screens"]
    assert run([*words, "--screen-model", str(other)]) == 2
    told = capsys.readouterr().err
    assert "it has 1 outputs, the first with the shape (1, 10, 6)" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_an_output_that_is_not_finite_is_told(tmp_path: Path, value: float) -> None:
    values = np.zeros((1, 84, 5))
    values[0, 4 + CAT, 3] = value
    with pytest.raises(UnknownModel) as caught:
        Yolo(cv2, network(tmp_path / "broken.onnx", values, seen=(0, 4 + LAPTOP, 2)))
    assert "its output for a black picture is not finite" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_shape_of_the_input_is_read_past_constants(tmp_path: Path) -> None:
    assert input_shape(yolov8(tmp_path / "v8.onnx").read_bytes()) == (1, 3, SIDE, SIDE)
    assert input_shape(model([], [], tensor_type("images", (2**64 - 1, 3, 64, 64)), [])) == (0, 3, 64, 64), (
        "-1 is open"
    )
    with pytest.raises(ValueError, match="cut short"):
        input_shape(yolov8(tmp_path / "v8.onnx").read_bytes()[:-300])
