"""The on-disk cache of travel costs, one file per floor plan.

The folder is $LIOS_CACHE, or ~/.cache/lios-workbench; LIOS_CACHE=off disables it. File names are hashes of the
floor plan and the settings; files are written atomically, so that many processes can share them. Unreadable files
are ignored.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from zipfile import BadZipFile

import msgspec
import numpy as np

from workbench.cache import cache_folder
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, FloorPlan, LocationId
from workbench.worlds.maps.navigation import Navigation
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.travel import TravelCosts

VERSION = 1
"""Version of the computation of travel costs; part of the file names."""


def load_navigation(plan: FloorPlan, *, resolution_m: float, robot_radius_m: float) -> Navigation | None:
    """The cached navigation, or None."""
    path = _file(plan, resolution_m, robot_radius_m)
    if path is None or not path.is_file():
        return None
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as kept:
            return _unpacked(plan, resolution_m, {name: kept[name] for name in kept.files})
    except (OSError, ValueError, KeyError, IndexError, EOFError, BadZipFile):
        return None


def store_navigation(navigation: Navigation, plan: FloorPlan, *, resolution_m: float, robot_radius_m: float) -> None:
    """Cache a result; ignored if the folder is not writable."""
    path = _file(plan, resolution_m, robot_radius_m)
    if path is None:
        return
    poses = [(pose.x_m, pose.y_m, pose.yaw_rad) for pose in navigation.standing.values()]
    order = {container.id: index for index, container in enumerate(plan.containers)}
    reachable = [order[c.id] for c in plan.containers if LocationId(c.id) in navigation.standing]
    arrays = {
        "metres": navigation.travel.metres,
        "reachable": np.array(reachable, dtype=np.int64),
        "standing": np.array(poses, dtype=np.float64),
        "occupied": np.packbits(navigation.grid.occupied),
        "free": np.packbits(navigation.free),
        "shape": np.array(navigation.free.shape, dtype=np.int64),
        "origin": np.array(navigation.grid.origin, dtype=np.float64),
    }
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".writing-")
        try:
            with os.fdopen(handle, "wb") as stream:
                np.savez(stream, allow_pickle=False, **arrays)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError:
        return


def _file(plan: FloorPlan, resolution_m: float, robot_radius_m: float) -> Path | None:
    folder = cache_folder()
    if folder is None:
        return None
    key = hashlib.sha256(msgspec.json.encode((VERSION, plan, resolution_m, robot_radius_m))).hexdigest()
    return folder / "travel" / key[:2] / f"{key[:40]}.npz"


def _unpacked(plan: FloorPlan, resolution_m: float, kept: dict[str, np.ndarray]) -> Navigation:
    rows, columns = (int(side) for side in kept["shape"])

    def bits(name: str) -> np.ndarray:
        return np.unpackbits(kept[name], count=rows * columns).reshape(rows, columns).astype(np.bool_)

    reached = [plan.containers[index].id for index in kept["reachable"].tolist()]
    locations = (START, *(LocationId(container) for container in reached))
    poses = [Pose(x_m=x, y_m=y, yaw_rad=yaw) for x, y, yaw in kept["standing"].tolist()]
    origin = (float(kept["origin"][0]), float(kept["origin"][1]))
    free = bits("free")
    free.flags.writeable = False
    return Navigation(
        travel=TravelCosts(
            locations=locations,
            metres=kept["metres"],
            unreachable=tuple(c.id for c in plan.containers if c.id not in set(reached)),
        ),
        grid=OccupancyGrid(origin=origin, resolution_m=resolution_m, occupied=bits("occupied")),
        free=free,
        standing=dict(zip(locations, poses, strict=True)),
    )
