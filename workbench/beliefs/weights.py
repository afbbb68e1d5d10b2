"""Weights files: tensors and a JSON header in a safetensors file, read without unpickling.

The header is one metadata entry, "lios": a JSON document with sorted keys, so that the same training writes the
same bytes (safetensors itself keeps several entries in no fixed order).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from workbench.arrays import AnyArray
from workbench.errors import FileMissing, MalformedFile
from workbench.files import write_atomically

VERSION = 1
"""Version of the tensors' meaning."""

MAX_BYTES = 64 * 2**20
"""A weights file beyond this is refused before it is read."""


class Header(msgspec.Struct, frozen=True, kw_only=True):
    """The header of a weights file.

    Attributes:
        estimator: "counts", "fcnn", "best".
        version: VERSION at the time of writing.
        encoder: the name of the text encoder whose vectors it was trained on; "" if it uses none.
        houses_sha256: hash of the houses that it was trained on (names and contents).
        houses: number of training houses.
        seed: seed of the training.
        metrics: measured on held-out houses at the end of training.
        settings: settings of the estimator: names of rooms, containers and items, sizes, temperatures.
    """

    estimator: str
    version: int
    encoder: str
    houses_sha256: str
    houses: int
    seed: int
    metrics: dict[str, float]
    settings: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """A weights file in memory: its header, its tensors (read-only), and the hash of its bytes."""

    header: Header
    tensors: Mapping[str, AnyArray]
    sha256: str
    path: Path

    @property
    def name(self) -> str:
        """The estimator with a short hash: "fcnn@1a2b3c4d"."""
        return f"{self.header.estimator}@{self.sha256[:8]}"

    def tensor(self, name: str, *shape: int | None) -> AnyArray:
        """A tensor, checked to be numeric, finite and of this shape (None matches any length).

        Raises:
            MalformedFile: it is missing or fails a check.
        """
        if name not in self.tensors:
            raise MalformedFile(self.path, f"has no tensor {name!r}", _TRAIN)
        value = self.tensors[name]
        fits = value.ndim == len(shape) and all(
            want in (None, have) for want, have in zip(shape, value.shape, strict=True)
        )
        if not fits:
            raise MalformedFile(self.path, f"tensor {name!r} has shape {value.shape} and not {shape}", _TRAIN)
        if value.dtype.kind not in "fiu" or not np.isfinite(value).all():
            raise MalformedFile(self.path, f"tensor {name!r} holds a number that is not finite", _TRAIN)
        return value

    def names(self, setting: str) -> tuple[str, ...]:
        """A setting that is a non-empty list of distinct names.

        Raises:
            MalformedFile: it is something else.
        """
        try:
            names = msgspec.convert(self.header.settings.get(setting), type=tuple[str, ...])
        except msgspec.ValidationError:
            names = ()
        if not names or len(set(names)) != len(names):
            raise MalformedFile(self.path, f"its vocabulary of {setting} is empty or repeats a name", _TRAIN)
        return names

    def layers(self, prefix: str, width: int) -> tuple[tuple[AnyArray, AnyArray], ...]:
        """Layers of a network with one output, "<prefix>0.weight", "<prefix>0.bias", ..., as float64.

        Raises:
            MalformedFile: their shapes do not fit together or the input width.
        """
        count = sum(name.startswith(prefix) and name.endswith(".weight") for name in self.tensors)
        if not 1 <= count <= 16:
            raise MalformedFile(self.path, f"holds {count} layers {prefix!r}", _TRAIN)
        found: list[tuple[AnyArray, AnyArray]] = []
        for k in range(count):
            weight = self.tensor(f"{prefix}{k}.weight", None, width).astype(np.float64)
            found.append((weight, self.tensor(f"{prefix}{k}.bias", len(weight)).astype(np.float64)))
            width = len(weight)
        if width != 1:
            raise MalformedFile(self.path, f"its last layer has {width} outputs and not 1", _TRAIN)
        return tuple(found)


def write_weights(path: Path, header: Header, tensors: Mapping[str, AnyArray]) -> Weights:
    """Write a weights file; the same header and tensors give the same bytes."""
    from safetensors.numpy import save

    entry = msgspec.json.encode(header, order="sorted").decode()
    data = save({k: np.ascontiguousarray(tensors[k]) for k in sorted(tensors)}, metadata={_ENTRY: entry})
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, data)
    return read_weights(path)


def read_weights(path: Path, *, estimator: str | None = None) -> Weights:
    """Read and check a weights file.

    Args:
        path: the file.
        estimator: the required estimator; None for any.

    Raises:
        FileMissing: there is no such file.
        MalformedFile: not safetensors, truncated, without our header, of another version or estimator.
    """
    if not path.is_file():
        raise FileMissing(path)
    if path.stat().st_size > MAX_BYTES:
        raise MalformedFile(path, f"holds more than {MAX_BYTES >> 20} MB", "Give a weights file of this project")
    data = path.read_bytes()
    header = _header(path, data)
    if header.version != VERSION:
        raise MalformedFile(path, f"weights of version {header.version}; this program reads {VERSION}", _TRAIN)
    if estimator is not None and header.estimator != estimator:
        fix = f"Give --estimator {header.estimator}, or train {estimator!r} with lios train"
        raise MalformedFile(path, f"weights of {header.estimator!r} and not of {estimator!r}", fix)
    return Weights(header=header, tensors=_tensors(path, data), sha256=hashlib.sha256(data).hexdigest(), path=path)


_ENTRY = "lios"
_TRAIN = "Train it again with lios train"
_NOT = "not a safetensors file, or truncated"


def _header(path: Path, data: bytes) -> Header:
    length = int.from_bytes(data[:8], "little")
    if len(data) < 8 or length > len(data) - 8:
        raise MalformedFile(path, _NOT, "Give a weights file written by lios train")
    try:
        described = json.loads(data[8 : 8 + length])
        entry = described["__metadata__"][_ENTRY]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise MalformedFile(path, "without the header of this project", "Give a file written by lios train") from None
    try:
        return msgspec.json.decode(entry, type=Header)
    except (msgspec.MsgspecError, TypeError) as error:
        raise MalformedFile(path, f"its header cannot be read ({error})", _TRAIN) from None


def _tensors(path: Path, data: bytes) -> Mapping[str, AnyArray]:
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        tensors = load(data)
    except (SafetensorError, KeyError, ValueError, TypeError):
        raise MalformedFile(path, _NOT, "Give a weights file written by lios train") from None
    for tensor in tensors.values():
        tensor.flags.writeable = False
    return tensors
