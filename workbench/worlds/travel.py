"""Travel costs between all pairs of reachable locations, along collision-free paths.

The matrix contains only locations reachable from the start, so every entry is finite; the others are listed by
name. A missing path is None, never a large number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.caches import PerObject
from workbench.errors import BadValue
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, LocationId

ROW_CACHE_SIZE = 10_000
"""Number of groups of locations whose indices are cached; beyond it, the cache is emptied."""


class Sight(Protocol):
    """What a robot that sees in passing sees on its ways."""

    def coming_into_view(self, a: LocationId, b: LocationId) -> tuple[tuple[ContainerId, float, float], ...]:
        """The containers that come into view on the way from a to b, in order, with the metres of the way before
        that and the metres from there to the container."""
        ...

    def metres_from_view(self, a: LocationId, b: LocationId) -> Floats | None:
        """Metres from where b comes into view on the way from a, in the order of the travel costs; None where it
        comes into view nowhere before its end."""
        ...


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class TravelCosts:
    """Shortest-path lengths in metres between all pairs of reachable locations.

    Attributes:
        locations: the axis of the matrix: START first, then reachable containers in the plan's order.
        metres: float64, shape (locations, locations), read-only, symmetric up to measured costs, zero diagonal.
        unreachable: containers without a path to them.
        sight: what the robot sees on its ways; None for one that sees nothing in passing. Not compared.

    Raises:
        BadValue: the matrix has another shape, or an entry is negative or not finite.
    """

    locations: tuple[LocationId, ...]
    metres: Floats
    unreachable: tuple[ContainerId, ...] = ()
    sight: Sight | None = field(default=None, repr=False, compare=False)
    _index: Mapping[LocationId, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        metres = np.array(self.metres, dtype=np.float64)
        n = len(self.locations)
        if metres.shape != (n, n):
            raise BadValue("travel costs", metres.shape, f"a square matrix of {n} locations")
        if not np.isfinite(metres).all() or (metres < 0).any():
            raise BadValue("travel costs", "a negative or non-finite entry", "finite metres, at least 0")
        metres.flags.writeable = False
        object.__setattr__(self, "metres", metres)
        object.__setattr__(self, "_index", {name: i for i, name in enumerate(self.locations)})
        if len(self._index) != n:
            raise BadValue("locations of the travel costs", self.locations, "different from one another")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TravelCosts):
            return NotImplemented
        names = (self.locations, self.unreachable) == (other.locations, other.unreachable)
        return names and np.array_equal(self.metres, other.metres)

    def __hash__(self) -> int:
        return hash((self.locations, self.metres.tobytes(), self.unreachable))

    def index(self, location: LocationId) -> int:
        """The row and column of a location.

        Raises:
            KeyError: it is unreachable.
        """
        return self._index[location]

    def rows(self, locations: tuple[str, ...]) -> Indices:
        """The indices of several locations, read-only; remembered, since searches ask for the same again and again.

        Raises:
            KeyError: one of them is unreachable.
        """
        return _ROWS.of(self).get(locations, lambda: self._rows_of(locations))

    def _rows_of(self, locations: tuple[str, ...]) -> Indices:
        found = np.array([self._index[LocationId(location)] for location in locations], dtype=np.intp)
        found.flags.writeable = False
        return found

    def reaches_all(self, locations: tuple[str, ...]) -> bool:
        return locations in _ROWS.of(self) or all(location in self._index for location in locations)

    def reaches(self, location: LocationId) -> bool:
        return location in self._index

    def between(self, a: LocationId, b: LocationId) -> float | None:
        """Distance in metres from a to b; None if one of them is unreachable."""
        if a not in self._index or b not in self._index:
            return None
        return float(self.metres[self._index[a], self._index[b]])


_ROWS: PerObject[tuple[str, ...], Indices] = PerObject(ROW_CACHE_SIZE)


def shortest_paths(metres: Floats) -> Floats:
    """The shortest ways between all locations where a way may lead through others: at most the given ones, and a
    metric (Floyd-Warshall)."""
    found = np.array(metres, dtype=np.float64)
    for via in range(len(found)):
        np.minimum(found, found[:, via, None] + found[None, via, :], out=found)
    return found


class Paths(Protocol):
    """The paths behind travel costs, for execution and display."""

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        """Corner points from a to b in the map frame, both ends included; None if there is no path."""
        ...

    def standing_pose(self, location: LocationId) -> Pose | None:
        """The pose at which the robot uses a location, facing it; None if unreachable."""
        ...
