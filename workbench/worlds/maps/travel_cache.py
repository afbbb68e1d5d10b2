"""The on-disk cache of travel costs, one file per floor plan.

The folder is $LIOS_CACHE, or ~/.cache/lios-workbench; LIOS_CACHE=off disables it. File names are hashes of the floor
plan and the settings; files are written atomically, and many processes can share them. Unreadable files are ignored.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from zipfile import BadZipFile

import msgspec
import numpy as np

from workbench.arrays import AnyArray
from workbench.files import atomic, cache_folder
from workbench.worlds.house import FloorPlan

VERSION = 1
"""Version of the computation of travel costs; part of the file names."""


Arrays = dict[str, AnyArray]


def load_arrays(plan: FloorPlan, *, resolution_m: float, robot_radius_m: float) -> Arrays | None:
    """The cached arrays of a floor plan, or None."""
    path = _file(plan, resolution_m, robot_radius_m)
    if path is None or not path.is_file():
        return None
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            return {name: kept[name] for name in kept.files}
    except (OSError, ValueError, KeyError, IndexError, EOFError, BadZipFile):
        return None


def store_arrays(arrays: Arrays, plan: FloorPlan, *, resolution_m: float, robot_radius_m: float) -> None:
    """Cache the arrays of a floor plan; ignored if the folder is not writable."""
    path = _file(plan, resolution_m, robot_radius_m)
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic(path) as draft, draft.open("wb") as stream:
            np.savez(stream, allow_pickle=False, **arrays)
    except OSError:
        return


def _file(plan: FloorPlan, resolution_m: float, robot_radius_m: float) -> Path | None:
    folder = cache_folder()
    if folder is None:
        return None
    key = hashlib.sha256(msgspec.json.encode((VERSION, plan, resolution_m, robot_radius_m))).hexdigest()
    return folder / "travel" / key[:2] / f"{key[:40]}.npz"
