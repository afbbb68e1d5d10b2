"""Models of TensorFlow.js (graph-model: JSON beside one file of weights), made ones of ONNX, which OpenCV reads.

TensorFlow keeps pictures as (rows, columns, channels), ONNX as (channels, rows, columns). Convolutions are padded as
TensorFlow's SAME: what is missing at the end is one more than at the start if it is odd.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, final

import msgspec
import numpy as np

from replayers.log_tools.faces.screens.onnx_model import Attribute, constant, model, operator, tensor_type
from workbench.arrays import AnyArray
from workbench.errors import Malformed

Node = Mapping[str, Any]
_SAME_NAME = {"Relu": "Relu", "Sigmoid": "Sigmoid", "Identity": "Identity", "Add": "Add", "Mul": "Mul"}
_CONVOLUTIONS = ("_FusedConv2D", "Conv2D", "FusedDepthwiseConv2dNative", "DepthwiseConv2dNative")


class UnknownOperator(Malformed):
    """A graph with an operator that is not translated."""

    def __init__(self, name: str, kind: str) -> None:
        super().__init__(f"{name}: the operator {kind} of TensorFlow.js is not translated. Export the model as ONNX.")


def onnx_of(graph: bytes, weights: bytes, outputs: Sequence[str]) -> bytes:
    """The part of a graph that its outputs need, as an ONNX model with tensors of the same names.

    Args:
        graph: model.json. weights: the file that it names.
        outputs: names of operators; shape (1, channels, rows, columns).

    Raises:
        UnknownOperator: it needs an operator that is not translated.
    """
    told = msgspec.json.decode(graph, type=dict[str, Any])
    nodes: dict[str, Node] = {node["name"]: node for node in told["modelTopology"]["node"]}
    work = _Translation(nodes=nodes, values=_values(told["weightsManifest"][0]["weights"], weights))
    for name in _in_order(nodes, outputs):
        work.translate(nodes[name])
    return model(
        work.operators,
        work.constants,
        tensor_type(work.given, (1, *work.shapes[work.given])),
        [tensor_type(name, (1, *work.shapes[name])) for name in outputs],
    )


def _values(manifest: Sequence[Mapping[str, Any]], weights: bytes) -> dict[str, AnyArray]:
    """The constants of a graph by name; weights are 16-bit floats where the manifest says so."""
    values, at = dict[str, AnyArray](), 0
    for one in manifest:
        kind = "<f2" if "quantization" in one else {"float32": "<f4", "int32": "<i4"}[one["dtype"]]
        count = math.prod(one["shape"])
        values[one["name"]] = np.frombuffer(weights, kind, count, at).reshape(one["shape"])
        at += count * np.dtype(kind).itemsize
    return values


def _in_order(nodes: Mapping[str, Node], outputs: Sequence[str]) -> list[str]:
    """What the outputs need, each after what it needs itself."""
    order, waiting = dict[str, None](), [*reversed(outputs)]
    while waiting:
        missing = [name for name in nodes[waiting[-1]].get("input", ()) if name not in order]
        if missing:
            waiting.extend(reversed(missing))
        else:
            order[waiting.pop()] = None
    return list(order)


@final
@dataclass(slots=True, kw_only=True)
class _Translation:
    """The state of one translation.

    Attributes:
        values: constants by name. shapes: channels, rows and columns of what was translated, by name.
        given: the name of the input.
    """

    nodes: Mapping[str, Node]
    values: Mapping[str, AnyArray]
    operators: list[bytes] = field(default_factory=list[bytes])
    constants: list[bytes] = field(default_factory=list[bytes])
    shapes: dict[str, tuple[int, int, int]] = field(default_factory=dict[str, tuple[int, int, int]])
    given: str = ""

    def translate(self, node: Node) -> None:
        """Appends one operator of the graph."""
        name, kind, inputs = node["name"], node["op"], list(node.get("input", ()))
        if kind == "Const":
            return
        if kind == "Placeholder":
            self.given = name
            _, rows, columns, channels = (int(dim["size"]) for dim in node["attr"]["shape"]["shape"]["dim"])
            self.shapes[name] = channels, rows, columns
        elif kind in _CONVOLUTIONS:
            self._convolution(node, depthwise="epthwise" in kind)
        else:
            self._plain(name, kind, inputs)

    def _plain(self, name: str, kind: str, inputs: list[str]) -> None:
        """An operator that is no convolution."""
        moving = [one for one in inputs if one in self.shapes]
        channels, rows, columns = max(self.shapes[one] for one in moving)
        if kind in _SAME_NAME:
            for one in set(inputs) - set(moving):  # per channel, or one value for all
                self.constants.append(constant(one, self.values[one].reshape(-1, 1, 1)))
            self.operators.append(operator(_SAME_NAME[kind], inputs, name))
        elif kind == "Relu6":
            self.constants += [constant(f"{name}/min", np.array(0.0)), constant(f"{name}/max", np.array(6.0))]
            self.operators.append(operator("Clip", [*moving, f"{name}/min", f"{name}/max"], name))
        elif kind == "Mean":
            self.operators.append(operator("GlobalAveragePool", moving, name))
            rows, columns = 1, 1
        elif kind == "ConcatV2":
            self.operators.append(operator("Concat", moving, name, {"axis": 1}))
            channels = sum(self.shapes[one][0] for one in moving)
        elif kind == "ResizeBilinear":
            wanted = (int(self.values[inputs[1]][0]), int(self.values[inputs[1]][1]))
            self.constants.append(constant(f"{name}/scale", np.array([1, 1, wanted[0] / rows, wanted[1] / columns])))
            how = {"mode": "linear", "coordinate_transformation_mode": "asymmetric"}
            self.operators.append(operator("Resize", [*moving, "", f"{name}/scale"], name, how))
            rows, columns = wanted
        else:
            raise UnknownOperator(name, kind)
        self.shapes[name] = channels, rows, columns

    def _convolution(self, node: Node, *, depthwise: bool) -> None:
        """A convolution with the bias and the rectifier that are fused into it, if any."""
        name, inputs, attributes = node["name"], node["input"], node["attr"]
        kernel = self.values[inputs[1]]  # rows, columns, channels in, channels out
        high, wide, channels = kernel.shape[0], kernel.shape[1], kernel.shape[2 if depthwise else 3]
        stride = int(attributes["strides"]["list"]["i"][1])
        _, rows, columns = self.shapes[inputs[0]]
        (top, bottom), (left, right) = _same(rows, high, stride), _same(columns, wide, stride)
        turned = kernel.transpose(2, 3, 0, 1) if depthwise else kernel.transpose(3, 2, 0, 1)
        self.constants.append(constant(f"{name}/kernel", turned))
        taken = [inputs[0], f"{name}/kernel"]
        fused = [base64.b64decode(one) for one in attributes.get("fused_ops", {}).get("list", {}).get("s", ())]
        if b"BiasAdd" in fused:
            self.constants.append(constant(f"{name}/bias", self.values[inputs[2]]))
            taken.append(f"{name}/bias")
        bare = f"{name}/bare" if b"Relu" in fused else name
        how: dict[str, Attribute] = {
            "kernel_shape": (high, wide),
            "strides": (stride, stride),
            "pads": (top, left, bottom, right),
            "group": channels if depthwise else 1,
        }
        self.operators.append(operator("Conv", taken, bare, how))
        if bare != name:
            self.operators.append(operator("Relu", [bare], name))
        self.shapes[name] = channels, -(-rows // stride), -(-columns // stride)


def _same(side: int, kernel: int, stride: int) -> tuple[int, int]:
    """How far a side is padded before its start and after its end."""
    missing = max((-(-side // stride) - 1) * stride + kernel - side, 0)
    return missing // 2, missing - missing // 2
