"""Weights files: round trip, the same bytes for the same training, and a clear error for anything else."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from safetensors.numpy import save

from workbench.beliefs.estimators import estimator, shipped_weights
from workbench.beliefs.weights import VERSION, Header, read_weights, write_weights
from workbench.errors import BadValue, FileMissing, MalformedFile
from workbench.plugins import NameOrigin

HEADER = Header(
    estimator="counts",
    version=VERSION,
    encoder="",
    houses_sha256="ab",
    houses=2,
    seed=3,
    metrics={"loss": 0.1},
    settings={"rooms": ["Kitchen"], "containers": ["Fridge"], "items": ["Egg"]},
)
TENSORS = {
    "triples": np.zeros((1, 3), np.int32),
    "seen": np.ones(1, np.float32),
    "held": np.ones(1, np.float32),
}


def test_round_trip_and_the_same_bytes(tmp_path: Path) -> None:
    a = write_weights(tmp_path / "a.safetensors", HEADER, TENSORS)
    b = write_weights(tmp_path / "b.safetensors", HEADER, TENSORS)
    assert a.path.read_bytes() == b.path.read_bytes()
    again = read_weights(a.path)
    assert again.header == HEADER
    assert again.name == f"counts@{a.sha256[:8]}"
    assert np.array_equal(again.tensor("seen", 1), [1.0])


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(FileMissing, match="no such file"):
        estimator("counts", weights=tmp_path / "no.safetensors")


@pytest.mark.parametrize(
    "data", [b"", b"PK\x03\x04not this", b"\x80\x04\x95pickle", b"\xff" * 64, b"\x02" + b"\0" * 7 + b"[]"]
)
def test_what_is_not_safetensors(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "x.safetensors"
    path.write_bytes(data)
    with pytest.raises(MalformedFile, match=r"x\.safetensors"):
        estimator("fcnn", weights=path)


@pytest.mark.parametrize("kept", [4, 200, 0.5, 0.999])
@pytest.mark.parametrize("name", ["counts", "fcnn", "best"])
def test_truncated(tmp_path: Path, name: str, kept: float) -> None:
    data = shipped_weights(name).read_bytes()
    path = tmp_path / "cut.safetensors"
    path.write_bytes(data[: int(kept if kept >= 1 else kept * len(data))])
    with pytest.raises(MalformedFile):
        estimator(name, weights=path)


def test_safetensors_of_somebody_else(tmp_path: Path) -> None:
    path = tmp_path / "other.safetensors"
    path.write_bytes(save({"x": np.zeros(3, np.float32)}))
    with pytest.raises(MalformedFile, match="header of this project"):
        estimator("fcnn", weights=path)


def test_another_version_estimator_or_vocabulary(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    path.write_bytes(_raw(msgspec.structs.replace(HEADER, version=VERSION + 1)))
    with pytest.raises(MalformedFile, match=f"version {VERSION + 1}"):
        estimator("counts", weights=path)
    write_weights(path, HEADER, TENSORS)
    with pytest.raises(MalformedFile, match="of 'counts' and not of 'fcnn'"):
        estimator("fcnn", weights=path)
    path.write_bytes(_raw(msgspec.structs.replace(HEADER, settings={**HEADER.settings, "items": []})))
    with pytest.raises(MalformedFile, match="vocabulary of items is empty"):
        estimator("counts", weights=path)


@pytest.mark.slow
def test_another_encoder(tmp_path: Path) -> None:
    shipped = read_weights(shipped_weights("fcnn"))
    path = tmp_path / "w.safetensors"
    write_weights(path, msgspec.structs.replace(shipped.header, encoder="no-such/encoder"), shipped.tensors)
    with pytest.raises((MalformedFile, Exception), match="no-such/encoder"):
        estimator("fcnn", weights=path)


def test_tensors_that_do_not_fit(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    for broken in (
        {**TENSORS, "seen": np.full(1, np.nan, np.float32)},
        {**TENSORS, "seen": np.ones(2, np.float32)},
        {**TENSORS, "triples": np.full((1, 3), 7, np.int32)},
        {**TENSORS, "held": np.full(1, 2.0, np.float32)},
        {"seen": TENSORS["seen"], "held": TENSORS["held"]},
    ):
        write_weights(path, HEADER, broken)
        with pytest.raises((MalformedFile, BadValue)):
            estimator("counts", weights=path)


def test_trees_that_ask_about_what_there_is_not(tmp_path: Path) -> None:
    shipped = read_weights(shipped_weights("best"))
    feature = shipped.tensors["trees.feature"].copy()
    feature[7, 1] = 1000
    path = tmp_path / "w.safetensors"
    write_weights(path, shipped.header, {**shipped.tensors, "trees.feature": feature})
    with pytest.raises(MalformedFile, match="use features that do not exist"):
        estimator("best", weights=path)


@pytest.mark.parametrize(
    ("name", "value"), [("rates", 0.0), ("rates", 1.0), ("several", 1.5), ("kinds.weight", 0.0), ("usual", -1.0)]
)
def test_placements_that_cannot_be(name: str, value: float, tmp_path: Path) -> None:
    shipped = read_weights(shipped_weights("best"))
    broken = shipped.tensors[name].copy()
    broken.flat[3] = value
    path = tmp_path / "w.safetensors"
    write_weights(path, shipped.header, {**shipped.tensors, name: broken})
    with pytest.raises(MalformedFile, match="impossible"):
        estimator("best", weights=path)


def _raw(header: Header) -> bytes:
    entry = msgspec.json.encode(header).decode()
    assert json.loads(entry)
    return save(TENSORS, metadata={"lios": entry})


def test_a_path_to_weights_is_an_estimator_too() -> None:
    by_path = estimator(str(shipped_weights("counts")), origin=NameOrigin.USER)
    assert by_path.name == estimator("counts").name
    with pytest.raises(FileMissing):
        estimator("no-such.safetensors", origin=NameOrigin.USER)
