"""Readable words for ids and actions: "dining table 4|1" for DiningTable|4|1, alone or within a sentence."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

from workbench.worlds.names import readable_name
from workbench.worlds.sight.sightings import ON_THE_WAY, stop_point

ID = re.compile(rf"\b{ON_THE_WAY}\|[\d.|-]*\d|\b([A-Za-z]\w*)\|(\d[\w|]*)")
"""The id of a stop on the way, or of a container in a house: its type, then numbers."""
MAX_LABEL_CHARS = 40
WORD = re.compile(r"\w+")
DOINGS: Mapping[str, str] = MappingProxyType(
    {
        "find": "find {}, bring to {to}",
        "move": "move to {to}",
        "search": "search {to}",
        "boil": "boil {} in {} at {to}",
        "peel": "peel {} with {} at {to}",
        "toast": "toast {} in {} at {to}",
        "pour-water": "pour water from {} into {} at {to}",
        "make-coffee": "make coffee from {} in {} at {to}",
        "pour-coffee": "pour coffee from {} into {} at {to}",
    }
)
"""Actions in words; items in the order of the action's parts."""


def place_words(location: str) -> str:
    """A readable location: the generic name of its kind, and which one; a stop on the way by its coordinates."""
    stop = stop_point(location)
    if stop is not None:
        return f"a stop on the way at ({stop[0]:.2f} m, {stop[1]:.2f} m)"
    kind, _, which = location.partition("|")
    return f"{readable_name(kind)} {which}".strip()


def label(words: str) -> str:
    """A name short enough for the view."""
    return words if len(words) <= MAX_LABEL_CHARS else words[: MAX_LABEL_CHARS - 1] + "…"


def humanize_ids(sentence: str, names: Collection[str] = ()) -> str:
    """A sentence with its ids replaced by readable words.

    Args:
        names: words to replace as well: item types, and ids of containers that are single words.
    """
    placed = ID.sub(lambda found: place_words(found[0]), sentence)
    return WORD.sub(lambda found: readable_name(found[0]) if found[0] in names else found[0], placed)


def action_words(action: str, item_types: Sequence[str], target: str) -> str:
    """What is done, with what, where: "move to fridge 1", "boil egg in pot at countertop 2|0"."""
    things = [readable_name(t) for t in item_types]
    doing, to = DOINGS.get(action, ""), place_words(target)
    if doing and doing.count("{}") == len(things):
        return doing.format(*things, to=to)
    return " ".join([action, *things, "at", to])
