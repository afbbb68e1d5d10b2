"""The shipped houses: 24 generated ones, so that everything works without a download."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def shipped_houses() -> Path:
    """The file of the shipped houses, one per line: shipped_houses():0 to :23.

    Made by `lios houses generate -n 24 --seed 2082 --stocked` (docs/worlds.md).
    """
    return Path(str(files("workbench").joinpath("data/houses.jsonl.gz")))


def house_file(path: Path) -> Path:
    """The file of houses that a path names: "houses" is the shipped one, as in "houses:9", unless a file has that
    name."""
    shipped = shipped_houses()
    return shipped if str(path) == shipped.name.partition(".")[0] and not path.is_file() else path
