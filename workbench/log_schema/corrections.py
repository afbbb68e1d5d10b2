"""Corrections of a log by a person: an item that was in a container although the looks into it did not show it.

A correction is a note (a Foxglove event on /notes) whose metadata names the item, its type and the container.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from workbench.worlds.house import ContainerId, Item, ItemId, ItemType

NOTE_TOPIC = "/notes"
NOTE_SCHEMA = "foxglove.Event"

_THERE_BEGIN, _THERE_END = "The operator says that ", " is here"
_ITEM, _TYPE, _CONTAINER = "seen_item", "seen_type", "seen_container"


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """What a person says was there.

    Attributes:
        item: which item; its id is made up where only its type was named.
        container: where it stood from the start of the run until the robot took it.
        stamp_ns: the moment that the note is about, in nanoseconds since the epoch.
        author: who says so; empty where nobody is named.
    """

    item: Item
    container: ContainerId
    stamp_ns: int
    author: str = ""

    @property
    def words(self) -> str:
        """ "Mug was in Desk|2" for a note without words of its own."""
        return f"{self.item.type if self.names_type_only else self.item.id} was in {self.container}"

    @property
    def names_type_only(self) -> bool:
        """Whether it says only of which type the item is; its id is made up."""
        return self.item.id == made_up_id(self.item.type, self.container)

    def as_pairs(self) -> Mapping[str, str]:
        """The metadata of the note."""
        return MappingProxyType({_ITEM: self.item.id, _TYPE: self.item.type, _CONTAINER: self.container})


def made_up_id(item_type: ItemType, container: ContainerId) -> ItemId:
    """The id of an item of which only the type and the container are known."""
    return ItemId(f"{item_type}|seen|{container}")


def said_there(item: str) -> str:
    """The note of an operator who sees an item where the robot looks; the look then shows it, detected or not."""
    return f"{_THERE_BEGIN}{item}{_THERE_END}"


def item_said_there(text: str) -> str | None:
    """The item of such a note; None for any other note."""
    if not (text.startswith(_THERE_BEGIN) and text.endswith(_THERE_END)):
        return None
    return text.removeprefix(_THERE_BEGIN).removesuffix(_THERE_END)


def correction_from(pairs: Mapping[str, str], *, stamp_ns: int) -> Correction | None:
    """The correction in the metadata of a note; None where it holds none."""
    if not all(pairs.get(name) for name in (_ITEM, _TYPE, _CONTAINER)):
        return None
    return Correction(
        item=Item(id=ItemId(pairs[_ITEM]), type=ItemType(pairs[_TYPE])),
        container=ContainerId(pairs[_CONTAINER]),
        stamp_ns=stamp_ns,
        author=pairs.get("author", ""),
    )
