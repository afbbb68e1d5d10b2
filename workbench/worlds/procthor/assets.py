"""The optional asset table: exact types and bounding boxes of assets by id."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from workbench.errors import FileMissing, MalformedFile

COLUMNS = ("asset_id", "object_type", "size_x_m", "size_y_m", "size_z_m")
BESIDE = "asset_sizes.csv"
"""A table of this name beside a house file is used for it."""

MAX_TABLE_BYTES = 64 * 1024 * 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class Asset:
    """An item type and its exact size (depth, width, height) in metres: x, y, z of its own frame."""

    type: str
    size_m: tuple[float, float, float]


def assets_for(houses: Path | str, given: Path | None) -> Path | None:
    """The asset table for a house file: the given one, else the one beside the file, else None.

    Args:
        houses: the file, or an address such as "houses.jsonl.gz:17".
    """
    beside = Path(houses).parent / BESIDE
    return given if given is not None or not beside.is_file() else beside


def read_assets(path: Path | None) -> Mapping[str, Asset]:
    """The assets by id; empty without a file.

    Raises:
        FileMissing, MalformedFile: the file is missing, or not an asset table.
    """
    if path is None:
        return {}
    if not path.is_file():
        raise FileMissing(path)
    if path.stat().st_size > MAX_TABLE_BYTES:
        raise MalformedFile(path, "too long for an asset table", f"Give a CSV of columns {', '.join(COLUMNS)}")
    try:
        with path.open(newline="", encoding="utf-8") as lines:
            return {row["asset_id"]: _asset(row) for row in csv.DictReader(lines)}
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        what = f"no asset table ({type(error).__name__}: {error})"
        raise MalformedFile(path, what, f"Give a CSV of columns {', '.join(COLUMNS)}") from None


def _asset(row: Mapping[str, str]) -> Asset:
    width, height, depth = (float(row[f"size_{axis}_m"]) for axis in "xyz")
    if not all(isfinite(side) and 0 <= side <= 100 for side in (width, height, depth)):
        raise ValueError(f"size of {row['asset_id']}")
    return Asset(type=row["object_type"], size_m=(depth, width, height))
