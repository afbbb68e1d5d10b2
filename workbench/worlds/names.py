"""The vocabulary of item and furniture types: names, sizes, and which are containers or can be carried.

The table is data/vocabulary.csv, with one row per type. Other types are interpreted by rule: "ObjaWallClock" (an
Objaverse asset of ProcTHOR) is a "wall clock". Sizes are medians over the things of that type in the training
houses of the shared ProcTHOR files, or over AI2-THOR's assets of a type that they do not have.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files

from workbench.errors import UnknownName

UNKNOWN_SIZE_M = (0.5, 0.5, 0.5)
"""Depth, width and height in metres of a type that is not in the table."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeEntry:
    """A row of the vocabulary.

    Attributes:
        type: in CamelCase, as ProcTHOR spells it.
        name: for people and for text encoders, in the singular.
        container: whether it is furniture that a robot searches.
        carry: whether a robot's arm can carry it.
        size_m: usual (depth, width, height): x, y, z of its own frame, x being its front.
        asset_names: further prefixes of the ids of AI2-THOR's assets of this type, besides its name.
        asset: an AI2-THOR asset of about the usual size; "" if there is none.
    """

    type: str
    name: str
    container: bool
    carry: bool
    size_m: tuple[float, float, float]
    asset_names: tuple[str, ...]
    asset: str


@cache
def vocabulary() -> Mapping[str, TypeEntry]:
    """The table, by type."""
    text = files("workbench").joinpath("data/vocabulary.csv").read_text(encoding="utf-8")
    return {row["type"]: _word(row) for row in csv.DictReader(text.splitlines())}


def readable_name(type_name: str) -> str:
    """The generic name of a type: "ShelvingUnit" -> "shelving unit", "ObjaWallClock" -> "wall clock"."""
    word = _vocabulary_row(type_name)
    return word.name if word else _split(type_name.removeprefix("Obja"))


def is_container(type_name: str) -> bool:
    """Whether a type is furniture that a robot searches."""
    word = vocabulary().get(type_name)
    return word is not None and word.container


def container_types() -> tuple[str, ...]:
    """The container types in the training data of the beliefs, sorted."""
    return tuple(sorted(name for name, word in vocabulary().items() if word.container))


def can_carry(type_name: str) -> bool:
    """Whether a robot's arm can carry an item of this type; True for types that are not in the table."""
    word = _vocabulary_row(type_name)
    return word is None or word.carry


def usual_size_m(type_name: str) -> tuple[float, float, float]:
    """Usual (depth, width, height) of a type: x, y, z of its own frame; half a metre each for an unknown type."""
    word = _vocabulary_row(type_name)
    return word.size_m if word else UNKNOWN_SIZE_M


def generic_type(type_name: str) -> str:
    """The type without its asset source: "ObjaEgg" is an "Egg", "ObjaCellphone" a "CellPhone"."""
    word = _vocabulary_row(type_name)
    return word.type if word else type_name.removeprefix("Obja")


def type_named(name: str, known: Iterable[str], *, kind: str = "item type") -> str:
    """The type for a name as typed by a user: "cell phone", "cell-phone" or "CellPhone".

    Raises:
        UnknownName: no known type of that name; suggests similar names.
    """
    types = sorted(known, key=lambda t: (t.startswith("Obja"), t))
    if name in types:
        return name
    wanted = _without_separators(name)
    for type_name in types:
        if wanted in (_without_separators(type_name), _without_separators(readable_name(type_name))):
            return type_name
    raise UnknownName(kind, name, {readable_name(t) for t in types})


@lru_cache(maxsize=20000)
def type_of_asset(asset_id: str) -> str | None:
    """The type of an AI2-THOR asset, by the prefix of its id: "TV_Stand_212_1" -> "TVStand", "bin_18" ->
    "GarbageCan".

    None for unknown assets, such as those of Objaverse.
    """
    name = asset_id.lower().removeprefix("robothor_")
    for prefix, type_name in _asset_prefixes():
        if name.startswith(prefix) and not name[len(prefix) : len(prefix) + 1].isalpha():
            return type_name
    return None


def size_of_asset_m(asset_id: str) -> tuple[float, float, float] | None:
    """The size of an asset whose id contains it: "Countertop_L_8x6" is 8 feet wide and 6 feet deep. None for
    others."""
    match = re.fullmatch(r"Countertop_[A-Za-z]+_(\d{1,2})x(\d{1,2})", asset_id)
    if match is None:
        return None
    foot_m = 0.3048
    return (int(match[2]) * foot_m, int(match[1]) * foot_m, usual_size_m("CounterTop")[2])


@cache
def _asset_prefixes() -> tuple[tuple[str, str], ...]:
    pairs = [
        (prefix, word.type)
        for word in vocabulary().values()
        for prefix in (_split(word.type).replace(" ", "_"), *word.asset_names)
    ]
    return tuple(sorted(pairs, key=lambda pair: (-len(pair[0]), pair)))


@lru_cache(maxsize=20000)
def _vocabulary_row(type_name: str) -> TypeEntry | None:
    """The row of a type, or of the type of the same name: "ObjaCellphone" is a "CellPhone"."""
    exact = vocabulary().get(type_name)
    if exact or not type_name.startswith("Obja"):
        return exact
    wanted = _without_separators(type_name.removeprefix("Obja"))
    return next(
        (w for w in vocabulary().values() if wanted in (_without_separators(w.type), _without_separators(w.name))),
        None,
    )


def _split(camel: str) -> str:
    """ "WallClock" -> "wall clock", "TVStand" -> "tv stand"."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])|[_\-\s]+", " ", camel).strip().lower()


def _without_separators(name: str) -> str:
    return re.sub(r"[\s_\-]+", "", name).lower()


def _word(row: Mapping[str, str]) -> TypeEntry:
    return TypeEntry(
        type=row["type"],
        name=row["name"],
        container=row["container"] == "yes",
        carry=row["carry"] == "yes",
        size_m=(float(row["depth_m"]), float(row["width_m"]), float(row["height_m"])),
        asset_names=tuple(row["asset_names"].split()),
        asset=row["asset"],
    )
