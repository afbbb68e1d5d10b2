"""The place of a run as stored in its log: floor plan, travel costs, standing poses and occupancy grid.

It is the attachment "place.json". Travel costs keep every digit, so that replayed distances are equal bit for bit.
The occupancy grid is packed to one bit per cell, compressed with zlib and encoded in base64.
"""

from __future__ import annotations

import base64
import hashlib
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from types import MappingProxyType

import msgspec
import numpy as np

from workbench.errors import BadValue, Malformed
from workbench.log_schema.task_json import TASK_ATTACHMENT, task_from_json, task_to_json
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, ContainerId, FloorPlan, LocationId
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.sight.sightings import PathsFromPoints
from workbench.worlds.travel import Paths, TravelCosts

__all__ = [
    "PLACE_ATTACHMENT",
    "TASK_ATTACHMENT",
    "Place",
    "house_sha256",
    "place_from_json",
    "place_to_json",
    "task_from_json",
    "task_to_json",
]

PLACE_ATTACHMENT = "place.json"
PLACE_VERSION = 1
MAX_CELLS = 64_000_000
"""Most cells of an occupancy grid; larger ones are taken as a damaged file."""


class MalformedPlace(Malformed):
    """The attachment place.json is invalid."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{PLACE_ATTACHMENT} describes no place: {reason}. Run lios doctor on the log.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A place as the robot knew it before any search, complete enough to replay motions in it.

    Attributes:
        standing: the robot's pose at each reachable location.
        occupancy: occupancy grid, for paths and for display; None if unknown.
        robot_radius_m: minimum distance in metres of the robot's centre from occupied cells.
    """

    plan: FloorPlan
    travel: TravelCosts
    standing: Mapping[LocationId, Pose] = field(default_factory=lambda: MappingProxyType({}))
    occupancy: OccupancyGrid | None = None
    robot_radius_m: float = 0.2

    @classmethod
    def of(cls, plan: FloorPlan, paths: Paths, *, travel: TravelCosts | None = None) -> Place:
        """The place of a floor plan and its paths; travel costs and grid come from `paths` if it has them.

        Raises:
            BadValue: `paths` has no travel costs, and none are given.
        """
        known, grid = travel or getattr(paths, "travel", None), getattr(paths, "grid", None)
        if not isinstance(known, TravelCosts):
            raise BadValue(f"travel costs of {plan.name}", known, "given, or kept by its paths")
        asked = ((location, paths.standing_pose(location)) for location in known.locations)
        standing = {location: pose for location, pose in asked if pose is not None}
        return cls(
            plan=plan,
            travel=known,
            standing=MappingProxyType(standing),
            occupancy=grid if isinstance(grid, OccupancyGrid) else None,
        )

    def paths(self) -> PathsFromPoints:
        """The paths between locations, recomputed on the occupancy grid; straight lines without a grid."""
        from workbench.log_schema.logged_paths import LoggedPaths

        return LoggedPaths(self.standing, self.travel, self.occupancy, self.robot_radius_m)


class _Travel(msgspec.Struct, frozen=True, kw_only=True):
    """For symmetric costs, row i of metres holds only its first i + 1 entries."""

    locations: tuple[str, ...]
    metres: tuple[tuple[float, ...], ...]
    symmetric: bool = False
    unreachable: tuple[str, ...] = ()


class _Occupancy(msgspec.Struct, frozen=True, kw_only=True):
    origin: Point
    resolution_m: float
    rows: int
    columns: int
    bits: str


class _Place(msgspec.Struct, frozen=True, kw_only=True):
    version: int
    plan: FloorPlan
    travel: _Travel
    standing: dict[str, Pose]
    occupancy: _Occupancy | None = None
    robot_radius_m: float = 0.2


def place_to_json(place: Place) -> bytes:
    """The attachment; the same place gives the same bytes."""
    grid = place.occupancy
    wire = _Place(
        version=PLACE_VERSION,
        plan=place.plan,
        travel=_travel_to_wire(place.travel),
        standing={name: place.standing[name] for name in sorted(place.standing)},
        occupancy=None if grid is None else _packed(grid),
        robot_radius_m=place.robot_radius_m,
    )
    return msgspec.json.encode(wire)


def place_from_json(data: bytes | str) -> Place:
    """Decode the attachment.

    Raises:
        MalformedPlace: not JSON, not a place, or an invalid grid.
    """
    try:
        wire = msgspec.json.decode(data, type=_Place)
        if wire.version > PLACE_VERSION:
            raise MalformedPlace(f"its version is {wire.version}, and this release reads up to {PLACE_VERSION}")
        travel = _travel_from_wire(wire.travel)
    except (msgspec.MsgspecError, UnicodeDecodeError, ValueError, RecursionError) as error:
        raise MalformedPlace(str(error)) from error
    return Place(
        plan=wire.plan,
        travel=travel,
        standing=MappingProxyType({LocationId(name): pose for name, pose in wire.standing.items()}),
        occupancy=None if wire.occupancy is None else _unpacked(wire.occupancy),
        robot_radius_m=wire.robot_radius_m,
    )


def house_sha256(place: Place) -> str:
    """The plan and its travel costs, hashed: a robot that starts elsewhere is in the same house."""
    names = place.travel.locations
    kept = [i for i, name in enumerate(names) if name != START]
    house = replace(
        place,
        plan=replace(place.plan, start=Pose(x_m=0.0, y_m=0.0)),
        travel=replace(
            place.travel,
            locations=tuple(names[i] for i in kept),
            metres=place.travel.metres[np.ix_(kept, kept)],
        ),
        standing=MappingProxyType({at: pose for at, pose in place.standing.items() if at != START}),
    )
    return hashlib.sha256(place_to_json(house)).hexdigest()


def _travel_to_wire(travel: TravelCosts) -> _Travel:
    symmetric = bool((travel.metres == travel.metres.T).all())
    rows: list[list[float]] = travel.metres.tolist()
    return _Travel(
        locations=travel.locations,
        metres=tuple(tuple(row[: i + 1] if symmetric else row) for i, row in enumerate(rows)),
        symmetric=symmetric,
        unreachable=travel.unreachable,
    )


def _travel_from_wire(wire: _Travel) -> TravelCosts:
    size = len(wire.locations)
    metres = np.zeros((size, size), dtype=np.float64)
    if len(wire.metres) != size:
        raise MalformedPlace(f"travel costs of {len(wire.metres)} rows for {size} locations")
    for i, row in enumerate(wire.metres):
        metres[i, : i + 1 if wire.symmetric else size] = row
    if wire.symmetric:
        metres += np.tril(metres, -1).T
    return TravelCosts(
        locations=tuple(LocationId(name) for name in wire.locations),
        metres=metres,
        unreachable=tuple(ContainerId(name) for name in wire.unreachable),
    )


def _packed(grid: OccupancyGrid) -> _Occupancy:
    rows, columns = grid.occupied.shape
    bits = zlib.compress(np.packbits(grid.occupied).tobytes(), 9)
    return _Occupancy(
        origin=grid.origin,
        resolution_m=grid.resolution_m,
        rows=rows,
        columns=columns,
        bits=base64.b64encode(bits).decode("ascii"),
    )


def _unpacked(wire: _Occupancy) -> OccupancyGrid:
    cells = wire.rows * wire.columns
    if wire.rows < 0 or wire.columns < 0 or cells > MAX_CELLS or not isfinite(wire.resolution_m):
        raise MalformedPlace(f"an occupancy grid of {wire.rows} x {wire.columns} cells")
    size = (cells + 7) // 8
    try:
        raw = zlib.decompressobj().decompress(base64.b64decode(wire.bits, validate=True), size + 1)
    except (ValueError, zlib.error) as error:
        raise MalformedPlace(f"occupancy: {error}") from error
    if len(raw) != size:
        raise MalformedPlace(f"occupancy: it does not hold {cells} cells")
    bits = np.unpackbits(np.frombuffer(raw, dtype=np.uint8), count=cells)
    return OccupancyGrid(
        origin=wire.origin,
        resolution_m=wire.resolution_m,
        occupied=bits.reshape(wire.rows, wire.columns).astype(np.bool_),
    )
