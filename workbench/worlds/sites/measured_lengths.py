"""Travel costs from measured path lengths: a matrix from move_base's make_plan, GraphNav, or a tape measure.

Without a map the paths themselves are unknown, so they are drawn as straight lines; costs stay as measured.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, cos, isfinite, sin
from pathlib import Path
from types import MappingProxyType
from typing import final

import numpy as np

from workbench.errors import FileMissing, MalformedFile
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, Container, FloorPlan, LocationId
from workbench.worlds.sites.survey_schema import TravelEntry
from workbench.worlds.travel import TravelCosts

MAX_LOCATIONS = 2_000
STAND_OFF_M = 0.5
"""Default distance in metres of the robot from a container's edge."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredNavigation:
    """Measured travel costs with straight paths. Implements Paths."""

    travel: TravelCosts
    standing: Mapping[LocationId, Pose]

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        if a not in self.standing or b not in self.standing:
            return None
        return (self.standing[a].point, self.standing[b].point)

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self.standing.get(location)


def measured_travel(
    path: Path, entry: TravelEntry, plan: FloorPlan, stand: Mapping[LocationId, Pose]
) -> MeasuredNavigation:
    """The measured matrix in the plan's order of locations; an entry of "" or inf means no path.

    Raises:
        FileMissing: the CSV is missing.
        MalformedFile: the matrix is not square, a name is not a location, a length is negative, or there is no
            row for the start.
    """
    source = path if entry.file is None else path.parent / entry.file
    names, rows = (entry.locations, entry.metres) if entry.file is None else _read_csv(source)
    known = [START, *(LocationId(c.id) for c in plan.containers)]
    strange = sorted(set(names) - set(known))
    if strange or len(set(names)) != len(names):
        what = f"travel names {', '.join(strange)}" if strange else "travel names a location twice"
        raise MalformedFile(source, what, f"Locations of this site: {', '.join(known)}")
    if START not in names or len(rows) != len(names) or any(len(row) != len(names) for row in rows):
        raise MalformedFile(source, "travel is not a square matrix with a row for 'start'", "One row a location")
    metres = np.array(rows, dtype=np.float64)
    if (np.isnan(metres) | (metres < 0)).any():
        raise MalformedFile(source, "travel holds a negative or missing length", "Write inf where there is no way")
    at_start = metres[list(names).index(START)]
    kept = [name for name in known if name in names and isfinite(at_start[list(names).index(name)])]
    order = [list(names).index(name) for name in kept]
    square = metres[np.ix_(order, order)]
    if not np.isfinite(square).all():
        raise MalformedFile(source, "two locations that the start reaches have no way between them", "Measure it")
    standing = {START: plan.start} | {
        LocationId(c.id): stand.get(LocationId(c.id)) or _in_front(c) for c in plan.containers if c.id in kept
    }
    return MeasuredNavigation(
        travel=TravelCosts(
            locations=tuple(kept),
            metres=square,
            unreachable=tuple(c.id for c in plan.containers if c.id not in kept),
        ),
        standing=MappingProxyType(standing),
    )


def _read_csv(path: Path) -> tuple[tuple[str, ...], tuple[tuple[float, ...], ...]]:
    if not path.is_file():
        raise FileMissing(path)
    with path.open(encoding="utf-8", newline="") as stream:
        lines = [row for row, _ in zip(csv.reader(stream), range(MAX_LOCATIONS + 2), strict=False) if row]
    if not lines or len(lines) > MAX_LOCATIONS + 1:
        raise MalformedFile(path, "no matrix of path lengths", "Name the locations in the first row and column")
    names = tuple(name.strip() for name in lines[0][1:])
    if tuple(row[0].strip() for row in lines[1:]) != names:
        raise MalformedFile(path, "its rows and columns differ in name or order", "Use the same names for both")
    try:
        return names, tuple(tuple(float(cell or "inf") for cell in row[1:]) for row in lines[1:])
    except ValueError as error:
        raise MalformedFile(path, str(error), "Write lengths in metres, inf where there is no way") from error


def _in_front(container: Container) -> Pose:
    """A pose in front of the container (its own -y side), facing it."""
    away = container.size_m[1] / 2 + STAND_OFF_M
    yaw = container.pose.yaw_rad
    x, y = container.pose.x_m + sin(yaw) * away, container.pose.y_m - cos(yaw) * away
    return Pose(x_m=x, y_m=y, yaw_rad=atan2(container.pose.y_m - y, container.pose.x_m - x))
