"""Graphs of TensorFlow.js as ONNX models: what OpenCV computes of them is what their operators say."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import pytest

from replayers.log_tools.faces.screens.web_graph import UnknownOperator, onnx_of
from workbench.arrays import Floats

cv2 = pytest.importorskip("cv2", reason="the extra opencv is not installed")
RNG = np.random.default_rng(7)
KERNEL, BIAS = RNG.normal(size=(3, 3, 2, 3)).astype("f2"), RNG.normal(size=3).astype("f2")
DEEP = RNG.normal(size=(5, 5, 3, 1)).astype("f2")


def node(name: str, op: str, inputs: list[str], **attr: Any) -> dict[str, Any]:
    return {"name": name, "op": op, "input": inputs, "attr": attr}


def convolution(stride: int, *fused: str) -> dict[str, Any]:
    """The attributes of a convolution with what is fused into it."""
    told = {"strides": {"list": {"i": ["1", str(stride), str(stride), "1"]}}}
    return {**told, "fused_ops": {"list": {"s": [base64.b64encode(one.encode()).decode() for one in fused]}}}


def graph(*more: dict[str, Any]) -> tuple[bytes, bytes]:
    """Nodes in no good order, and their weights: a picture of 6 by 8 with two channels, halved, gated, doubled."""
    sides = [{"size": str(side)} for side in (1, 6, 8, 2)]
    nodes = [
        node("joined", "ConcatV2", ["large", "picture", "axis"]),
        node("picture", "Placeholder", [], shape={"shape": {"dim": sides}}),
        node("half", "_FusedConv2D", ["picture", "kernel", "bias"], **convolution(2, "BiasAdd", "Relu")),
        node("deep", "DepthwiseConv2dNative", ["half", "deep_kernel"], **convolution(1)),
        node("clipped", "Relu6", ["deep"]),
        node("mean", "Mean", ["clipped", "axes"]),
        node("gate", "Sigmoid", ["mean"]),
        node("gated", "Mul", ["gate", "clipped"]),
        node("scaled", "Mul", ["sixth", "gated"]),
        node("large", "ResizeBilinear", ["scaled", "size"]),
        *(node(name, "Const", []) for name in ("kernel", "bias", "deep_kernel", "axes", "axis", "sixth", "size")),
        *more,
    ]
    floats = {"kernel": KERNEL, "bias": BIAS, "deep_kernel": DEEP, "sixth": np.array(0.5, "f2")}
    whole = {"axes": np.array([1, 2], "<i4"), "axis": np.array(3, "<i4"), "size": np.array([6, 8], "<i4")}
    manifest = [
        {"name": name, "shape": list(value.shape), "dtype": "float32", "quantization": {"dtype": "float16"}}
        for name, value in floats.items()
    ] + [{"name": name, "shape": list(value.shape), "dtype": "int32"} for name, value in whole.items()]
    told = {"modelTopology": {"node": nodes}, "weightsManifest": [{"weights": manifest}]}
    return json.dumps(told).encode(), b"".join(value.tobytes() for value in (*floats.values(), *whole.values()))


def convolved(picture: Floats, kernel: Floats, stride: int, pads: tuple[int, int]) -> Floats:
    """By the definition, with zeros before and after both sides; kernel (rows, columns, in, out), one in per out."""
    wide = np.pad(picture, (pads, pads, (0, 0)))
    side = kernel.shape[0]
    rows, columns = (wide.shape[0] - side) // stride + 1, (wide.shape[1] - side) // stride + 1
    parts = [
        [wide[r * stride : r * stride + side, c * stride : c * stride + side] for c in range(columns)]
        for r in range(rows)
    ]
    return np.array([[np.einsum("rci,rcio->o", part, kernel) for part in row] for row in parts])


def expected(picture: Floats) -> Floats:
    half = np.maximum(convolved(picture, KERNEL.astype(float), 2, (0, 1)) + BIAS.astype(float), 0)
    each = [convolved(half[:, :, [one]], DEEP.astype(float)[:, :, [one]], 1, (2, 2)) for one in range(3)]
    clipped = np.clip(np.concatenate(each, axis=2), 0, 6)
    gated = 0.5 * clipped / (1 + np.exp(-clipped.mean(axis=(0, 1))))
    rows, columns = np.minimum(np.arange(6) / 2, 2), np.minimum(np.arange(8) / 2, 3)  # the last is repeated
    up = (gated[np.floor(rows).astype(int)] + gated[np.ceil(rows).astype(int)]) / 2
    large = (up[:, np.floor(columns).astype(int)] + up[:, np.ceil(columns).astype(int)]) / 2
    return np.concatenate([large, picture], axis=2)


def test_a_graph_computes_what_its_operators_say() -> None:
    picture = np.random.default_rng(8).normal(size=(6, 8, 2))
    net = cv2.dnn.readNetFromONNX(np.frombuffer(onnx_of(*graph(), ("gated", "joined")), dtype=np.uint8))
    net.setInput(picture.transpose(2, 0, 1)[None].astype("f4"))
    gated, joined = net.forward(["gated", "joined"])
    assert gated.shape == (1, 3, 3, 4)
    assert gated.max() > 0.1, "the gate lets something through"
    assert np.allclose(joined[0].transpose(1, 2, 0), expected(picture), atol=1e-4)


def test_an_operator_that_is_not_translated_is_told() -> None:
    told = graph(node("best", "TopKV2", ["large"]))
    onnx_of(*told, ("large",))
    with pytest.raises(UnknownOperator, match="best: the operator TopKV2"):
        onnx_of(*told, ("best",))
