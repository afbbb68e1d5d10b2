"""Models in ONNX's wire format (onnx.proto, IR version 8, operators of set 13), as far as small networks need it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from workbench.arrays import AnyArray

Attribute = int | str | Sequence[int]
IR_VERSION, OPERATORS = 8, 13
_FLOAT = 1
"""onnx.TensorProto.FLOAT."""
_INT, _TEXT, _INTS = 2, 3, 7
"""onnx.AttributeProto.AttributeType."""


def operator(
    kind: str, inputs: Sequence[str], output: str, attributes: Mapping[str, Attribute] | None = None
) -> bytes:
    """A node with one output, which names it; an empty input is one that is left out."""
    told = b"".join(_bytes(5, _attribute(name, value)) for name, value in (attributes or {}).items())
    return (
        b"".join(_bytes(1, name.encode()) for name in inputs)
        + _bytes(2, output.encode())
        + _bytes(3, output.encode())
        + _bytes(4, kind.encode())
        + told
    )


def constant(name: str, values: AnyArray) -> bytes:
    """A tensor of 32-bit floats, of any shape."""
    data = np.array(values, dtype="<f4", order="C")
    shape = b"".join(_number(1, side) for side in data.shape)
    return shape + _number(2, _FLOAT) + _bytes(8, name.encode()) + _bytes(9, data.tobytes())


def tensor_type(name: str, shape: Iterable[int]) -> bytes:
    """The name and shape of an input or output of 32-bit floats."""
    sides = b"".join(_bytes(1, _number(1, side)) for side in shape)
    return _bytes(1, name.encode()) + _bytes(2, _bytes(1, _number(1, _FLOAT) + _bytes(2, sides)))


def model(operators: Iterable[bytes], constants: Iterable[bytes], given: bytes, outputs: Iterable[bytes]) -> bytes:
    """A whole model with one input."""
    graph = b"".join(_bytes(1, one) for one in operators) + _bytes(2, b"graph")
    graph += b"".join(_bytes(5, one) for one in constants)
    graph += _bytes(11, given) + b"".join(_bytes(12, one) for one in outputs)
    return _number(1, IR_VERSION) + _bytes(7, graph) + _bytes(8, _bytes(1, b"") + _number(2, OPERATORS))


def _attribute(name: str, value: Attribute) -> bytes:
    named = _bytes(1, name.encode())
    if isinstance(value, int):
        return named + _number(3, value) + _number(20, _INT)
    if isinstance(value, str):
        return named + _bytes(4, value.encode()) + _number(20, _TEXT)
    return named + b"".join(_number(8, one) for one in value) + _number(20, _INTS)


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, data: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(data)) + data


def _varint(value: int) -> bytes:
    """A number that is not negative, seven bits a byte, the lowest first."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)
