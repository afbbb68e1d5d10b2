"""The split of houses into training, validation and test, shared by all evaluations.

The shared ProcTHOR files are split by index, never by row: no container of a house is in two parts. Test houses are
used once, after everything has been chosen on the validation houses.

    multi_room_train.jsonl.gz    0-79 train, 80-99 validation, 100-119 test (older layout, AI2-THOR items only)
    single_room_train.jsonl.gz   0-399 train, 400-449 validation, 450-499 test

Any other file is used whole: none of its houses was used for training, so all may be evaluated.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType

from workbench.errors import UnknownName


class Split(StrEnum):
    """The part of the houses."""

    TRAIN = "train"
    VALIDATION = "validation"
    TEST = "test"
    ALL = "all"


MULTI_ROOM = "multi_room_train.jsonl.gz"
SINGLE_ROOM = "single_room_train.jsonl.gz"

SPLITS: Mapping[str, Mapping[Split, range]] = MappingProxyType(
    {
        MULTI_ROOM: MappingProxyType(
            {Split.TRAIN: range(80), Split.VALIDATION: range(80, 100), Split.TEST: range(100, 120)}
        ),
        SINGLE_ROOM: MappingProxyType(
            {Split.TRAIN: range(400), Split.VALIDATION: range(400, 450), Split.TEST: range(450, 500)}
        ),
    }
)
"""Indices of the houses of each part, by the file's name."""


def split_of(name: str) -> Split:
    """A part by its name.

    Raises:
        UnknownName: no such part.
    """
    try:
        return Split(name)
    except ValueError:
        raise UnknownName("part of the houses", name, [part.value for part in Split]) from None


def is_shared(path: Path | str) -> bool:
    """Whether a file is one of the shared files with a split."""
    return Path(path).name in SPLITS


def effective_split(path: Path | str, part: Split | str) -> Split:
    """The part that is actually used: ALL for files without a split."""
    return split_of(part) if is_shared(path) else Split.ALL


def split_indices(path: Path | str, part: Split | str, *, houses: int) -> tuple[int, ...]:
    """The indices of a part of a file of houses, in order.

    Args:
        path: the file; its name decides.
        part: which part. ALL, and every part of a file that is not shared, is all its houses.
        houses: how many houses the file holds; indices beyond it are left out.

    Raises:
        UnknownName: no such part.
    """
    split_of(part)
    taken = effective_split(path, part)
    if taken is Split.ALL:
        return tuple(range(houses))
    return tuple(i for i in SPLITS[Path(path).name][taken] if i < houses)
