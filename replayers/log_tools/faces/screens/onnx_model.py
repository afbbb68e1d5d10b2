"""Models in ONNX's wire format (onnx.proto, IR version 8, operators of set 13): small ones made, inputs read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from workbench.arrays import AnyArray

Attribute = int | str | Sequence[int]
IR_VERSION, OPERATORS = 8, 13
_FLOAT, _INT64 = 1, 7
"""onnx.TensorProto.DataType."""
_MAX_SIDE = 2**31 - 1
"""A larger side is -1, which some programs write for one that is left open."""
MAX_DEPTH = 8
"""How deep graphs are in attributes of nodes of graphs, as the branches of If are."""
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
    """A tensor of any shape: whole numbers as 64-bit ones, others as 32-bit floats."""
    whole = values.dtype.kind == "i"
    data = np.array(values, dtype="<i8" if whole else "<f4", order="C")
    shape = b"".join(_number(1, side) for side in data.shape)
    return shape + _number(2, _INT64 if whole else _FLOAT) + _bytes(8, name.encode()) + _bytes(9, data.tobytes())


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


def input_shape(data: bytes) -> tuple[int, ...]:
    """The shape of a model's first input that is no constant; 0 for a side that it leaves open.

    Raises:
        ValueError: it is no model in this format, or has no such input.
    """
    for field, graph in _fields(memoryview(data)):
        if field == 7 and not isinstance(graph, int):
            parts = list(_fields(graph))
            constants = {_named(part, 8) for field, part in parts if field == 5}
            for given in (part for field, part in parts if field == 11 and _named(part, 1) not in constants):
                kind = _inner(_inner(_inner(given, 2), 1), 2)
                return tuple(_side(dim) for field, dim in _fields(kind) if field == 1)
    raise ValueError("no input")


def unmade_input(data: bytes) -> str | None:
    """The first name that a node takes, while nothing before it makes it: no input, no constant, no other node.

    OpenCV ends the process on such a model.

    Raises:
        ValueError: it is no model in this format, or holds graphs in graphs in graphs.
    """
    parts = [part for field, graph in _fields(memoryview(data)) if field == 7 for part in _fields(_message(graph))]
    return _unmade(parts, frozenset(), MAX_DEPTH)


def _unmade(parts: Sequence[tuple[int, memoryview | int]], outer: frozenset[bytes], depth: int) -> str | None:
    if not depth:
        raise ValueError("graphs in graphs")
    made = {b"", *outer} | {_named(part, {5: 8, 11: 1}[field]) for field, part in parts if field in (5, 11)}
    for node in (list(_fields(_message(part))) for field, part in parts if field == 1):
        for name in (bytes(_message(value)) for field, value in node if field == 1):
            if name not in made:
                return name.decode(errors="replace")
        for told in (_message(value) for field, value in node if field == 5):
            for graph in (_message(value) for field, value in _fields(told) if field in (6, 11)):
                inner = _unmade(list(_fields(graph)), frozenset(made), depth - 1)
                if inner is not None:
                    return inner
        made |= {bytes(_message(value)) for field, value in node if field == 2}
    return None


def _side(dim: memoryview | int) -> int:
    found = [value for field, value in _fields(_message(dim)) if field == 1]
    return int(found[0]) if found and isinstance(found[0], int) and found[0] <= _MAX_SIDE else 0


def _named(part: memoryview | int, field: int) -> bytes:
    """A name in a message; of several the last counts."""
    names = [value for number, value in _fields(_message(part)) if number == field]
    return bytes(_message(names[-1])) if names else b""


def _inner(part: memoryview | int, wanted: int) -> memoryview:
    for field, value in _fields(_message(part)):
        if field == wanted:
            return _message(value)
    return memoryview(b"")


def _message(value: memoryview | int) -> memoryview:
    if isinstance(value, int):
        raise ValueError("a number where a message was expected")
    return value


def _fields(data: memoryview) -> Iterator[tuple[int, memoryview | int]]:
    """The fields of a message: numbers, and the bytes of all else."""
    at = 0
    while at < len(data):
        key, at = _read_varint(data, at)
        if key & 7 == 0:
            value, at = _read_varint(data, at)
            yield key >> 3, value
            continue
        if key & 7 == 2:
            size, at = _read_varint(data, at)
        elif key & 7 in (1, 5):
            size = 8 if key & 7 == 1 else 4
        else:
            raise ValueError("an unknown wire type")
        if at + size > len(data):
            raise ValueError("cut short")
        yield key >> 3, data[at : at + size]
        at += size


def _read_varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise ValueError("cut short")
        value |= (data[at] & 0x7F) << shift
        at += 1
        if data[at - 1] < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")


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
