"""The table of open furniture: containers whose contents a robot sees from a distance.

The table is data/open_furniture.csv: one row per container type, with the reason. Closed are the types with an asset
that AI2-THOR marks as one that opens (asset property CanOpen), and those whose sides hide what is in them.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType

from workbench.worlds.house import Container
from workbench.worlds.names import generic_type


@dataclass(frozen=True, slots=True, kw_only=True)
class Openness:
    """Whether furniture of one type needs no opening, and the reason."""

    open: bool
    reason: str


@cache
def open_furniture() -> Mapping[str, Openness]:
    """The table, by container type."""
    text = files("workbench").joinpath("data/open_furniture.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(text.splitlines())
    return MappingProxyType({row["type"]: Openness(open=row["open"] == "yes", reason=row["reason"]) for row in rows})


def needs_no_opening(container: Container) -> bool:
    """Whether a robot sees what is in a container from a distance; False for types that are not in the table."""
    found = open_furniture().get(generic_type(container.type))
    return found is not None and found.open
