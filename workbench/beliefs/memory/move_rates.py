"""Rates of moving per item type, in moves a day, and their table as a file.

A thing that was seen is still there after t days with the chance exp(-pace x rate x t): moves come independently, at
a constant rate (a Poisson process). The pace is a household's own factor on all rates.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from workbench.errors import BadValue, FileMissing, MalformedFile
from workbench.files import write_atomically
from workbench.worlds.house import ItemType
from workbench.worlds.names import generic_type

NS_PER_DAY = 86_400 * 1_000_000_000
OTHERS = "*"
"""The row of all item types that have none of their own."""
MAX_FILE_BYTES = 4 << 20
HEADER = ("item_type", "moves_per_day", "moves", "days")


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveRates:
    """Moves a day by item type.

    Attributes:
        others: the rate of types that `by_type` does not name; above 0.
        by_type: rates by generic type ("Mug", also for "ObjaMug"); above 0.

    Raises:
        BadValue: a rate that is not above 0 and finite.
    """

    others: float
    by_type: Mapping[ItemType, float] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        for name, rate in ((OTHERS, self.others), *self.by_type.items()):
            if not (rate > 0 and math.isfinite(rate)):
                raise BadValue(f"move rate of {name}", rate, "above 0")

    def of(self, item_type: ItemType) -> float:
        """Moves a day of one item of that type."""
        found = self.by_type.get(item_type)
        return self.by_type.get(ItemType(generic_type(item_type)), self.others) if found is None else found


@dataclass(frozen=True, slots=True, kw_only=True)
class RateRow:
    """One line of a table of rates: moves a day, and what it was learned from: moves in so many item-days."""

    item_type: str
    rate: float
    moves: float
    days: float


def rates_of(rows: tuple[RateRow, ...]) -> MoveRates:
    """The rates of a table.

    Raises:
        BadValue: no row for all other types, two rows for one type, or a rate that is not above 0.
    """
    names = [row.item_type for row in rows]
    if len(set(names)) != len(names):
        raise BadValue(
            "item types of move rates", sorted({n for n in names if names.count(n) > 1}), "named once each"
        )
    by_type = {ItemType(row.item_type): row.rate for row in rows if row.item_type != OTHERS}
    if OTHERS not in names:
        raise BadValue("move rates", "no row for other types", f"with a row {OTHERS!r} for all other types")
    return MoveRates(others=rows[names.index(OTHERS)].rate, by_type=MappingProxyType(by_type))


@cache
def shipped_rates() -> MoveRates:
    """The rates that this distribution ships (workbench/data/README.md says where they come from)."""
    text = files("workbench").joinpath("data/move_rates.csv").read_text(encoding="utf-8")
    return rates_of(_rows(text))


def read_rates(path: Path) -> MoveRates:
    """The rates in a file.

    Raises:
        FileMissing, MalformedFile: no such file, or none of rates.
    """
    if not path.is_file():
        raise FileMissing(path)
    if path.stat().st_size > MAX_FILE_BYTES:
        raise MalformedFile(path, f"holds more than {MAX_FILE_BYTES >> 20} MB", _FIX)
    try:
        return rates_of(_rows(path.read_text(encoding="utf-8")))
    except (ValueError, KeyError, TypeError, csv.Error, BadValue) as error:
        raise MalformedFile(path, f"holds no move rates ({error})".replace("\n", " "), _FIX) from None


_FIX = f"Give a file of lios learn-moves: columns {', '.join(HEADER)}"


def write_rates(path: Path, rows: tuple[RateRow, ...]) -> None:
    """Write a table of rates, sorted by type."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for row in sorted(rows, key=lambda r: r.item_type):
        writer.writerow([row.item_type, f"{row.rate:.6g}", f"{row.moves:g}", f"{row.days:.6g}"])
    write_atomically(path, text.getvalue().encode())


def _rows(text: str) -> tuple[RateRow, ...]:
    reader = csv.DictReader(text.splitlines())
    if tuple(reader.fieldnames or ()) != HEADER:
        raise ValueError(f"its columns are {', '.join(reader.fieldnames or ('none',))}")
    return tuple(
        RateRow(
            item_type=row["item_type"],
            rate=float(row["moves_per_day"]),
            moves=float(row["moves"]),
            days=float(row["days"]),
        )
        for row in reader
    )
