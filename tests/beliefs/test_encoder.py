"""The text encoder: shipped vectors equal live ones, generic names are readable, unknown names give a helpful
error."""

from __future__ import annotations

import importlib.util
import json
import socket
from pathlib import Path

import numpy as np
import pytest

from workbench.beliefs import encoder as module
from workbench.beliefs.encoder import (
    MINILM,
    NoSuchEncoder,
    ShippedVectors,
    generic_name,
    live_encoder,
    shipped_vectors,
    text_encoder,
    vectors_from,
    vectors_of,
    write_vectors,
)
from workbench.beliefs.weights import read_weights
from workbench.cli import run
from workbench.errors import BadValue, MissingExtra
from workbench.worlds.names import vocabulary
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses

live = pytest.mark.skipif(
    importlib.util.find_spec("sentence_transformers") is None, reason="the extra 'encoder' is not installed"
)


def test_generic_names_are_readable() -> None:
    assert [generic_name(t) for t in ("ShelvingUnit", "ObjaWallClock", "LivingRoom")] == [
        "shelving unit",
        "wall clock",
        "living room",
    ]
    assert len(generic_name("Mug" * 5000)) <= 400


def test_the_whole_vocabulary_is_shipped() -> None:
    names = {generic_name(t) for t in (*vocabulary(), "Kitchen", "LivingRoom", "Bedroom", "Bathroom")}
    assert names <= set(shipped_vectors().table)
    vectors = vectors_of(text_encoder(), ["Mug", "ObjaMug", "Fridge"])
    assert vectors.shape == (3, 384)
    assert np.allclose(np.linalg.norm(vectors, axis=1), 1.0, atol=1e-3)
    assert np.array_equal(vectors[0], vectors[1])


def test_meaning_is_near() -> None:
    fork, spoon, toilet = vectors_of(text_encoder(), ["Fork", "Spoon", "Toilet"])
    assert fork @ spoon > fork @ toilet + 0.1


def test_an_unknown_name_without_the_extra_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise MissingExtra(f"the text encoder {name!r}", "encoder")

    monkeypatch.setattr(module, "live_encoder", absent)
    vectors = ShippedVectors(name=MINILM, table=shipped_vectors().table)
    with pytest.raises(MissingExtra, match=r"'zonk'.*lios-workbench\[encoder\]"):
        vectors.encode(["zonk"])
    with pytest.raises(MissingExtra) as error:
        vectors.encode(["q" * 10_000])
    assert len(str(error.value)) < 300


def test_an_empty_vocabulary(tmp_path: object) -> None:
    with pytest.raises(BadValue, match="vocabulary"):
        write_vectors(tmp_path / "v.safetensors", [], text_encoder())  # type: ignore[operator]


@live
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_shipped_vectors_are_those_of_the_live_model() -> None:
    made = live_encoder(MINILM).encode(["mug"])[0]
    assert np.abs(made - shipped_vectors().encode(["mug"])[0]).max() < 1e-3
    strange = text_encoder().encode(["zonk the unheard of", "x" * 10_000])
    assert np.isfinite(strange).all()
    assert strange.shape == (2, 384)


@live
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_loading_the_model_draws_no_bar_where_nobody_watches(capfd: pytest.CaptureFixture[str]) -> None:
    module.live_encoder.__wrapped__(module.MINILM)
    assert capfd.readouterr().err == ""


@live
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_an_encoder_that_is_not_there_is_not_looked_for_in_the_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def called(*_: object, **__: object) -> None:
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket, "getaddrinfo", called)
    with pytest.raises(NoSuchEncoder, match=r"no-such/model.*no such folder or downloaded model"):
        live_encoder("no-such/model")


def test_names_of_all_houses_at_hand_are_shipped(procthor: Path) -> None:
    known = set(shipped_vectors().table)
    for path in (shipped_houses(), procthor / "multi_room_train.jsonl.gz"):
        for house in load_houses(path):
            types = (
                *house.item_types(),
                *(c.type for c in house.plan.containers),
                *(r.kind for r in house.plan.rooms),
            )
            assert {generic_name(t) for t in types} <= known


@live
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_the_command_that_made_the_shipped_vectors_makes_them_again(
    procthor: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    made = tmp_path / "vectors.safetensors"
    files = [procthor / "multi_room_train.jsonl.gz", procthor / "single_room_train.jsonl.gz"]
    houses = [part for path in files for part in ("--houses", str(path))]
    assert run(["train", *houses, "--estimator", "encoder", "-o", str(made), "--json"]) == 0
    again, shipped = vectors_from(read_weights(made)), shipped_vectors()
    assert json.loads(capfd.readouterr().out)["names"] == len(shipped.table)
    assert list(again.table) == list(shipped.table)
    assert max(np.abs(again.table[n] - shipped.table[n]).max() for n in shipped.table) < 2e-3
