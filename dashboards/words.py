"""How are ids told to people? "dining table 4|1" for DiningTable|4|1, alone or within a sentence."""

from __future__ import annotations

import re

from workbench.worlds.names import readable_name

ID = re.compile(r"\b([A-Za-z]\w*)\|(\d[\w|]*)")
"""A container as houses name them: its type, then numbers."""


def place_words(location: str) -> str:
    """A location for people: the generic name of its kind, and which of them."""
    kind, _, which = location.partition("|")
    return f"{readable_name(kind)} {which}".strip()


def told(sentence: str) -> str:
    """A sentence with the ids in it told for people."""
    return ID.sub(lambda found: place_words(found[0]), sentence)
