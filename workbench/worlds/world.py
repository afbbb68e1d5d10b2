"""What does a robot act in? A World: ask it to go, look, pick, place or prepare, and it answers what happened.

The simulation, the Spot robot and a recorded log are three Worlds under the same closed loop.
Answers are values; failing is an answer, not an exception.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from workbench.worlds.geometry import Point
from workbench.worlds.house import ContainerId, Contents, FloorPlan, Item, ItemId, LocationId
from workbench.worlds.travel import Paths, TravelCosts


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """It happened: how long it took, and for a move the metres gone and the way taken.

    Stamps are nanoseconds since the Unix epoch. travel_m is 0 for what is not a move.
    support says where the answer comes from: "logged", "implied" or "imputed" in a replay, "" elsewhere.
    """

    start_ns: int
    end_ns: int
    travel_m: float = 0.0
    path: tuple[Point, ...] = ()
    support: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Looked:
    """All that the container holds."""

    start_ns: int
    end_ns: int
    container: ContainerId
    items: tuple[Item, ...]
    support: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """A log cannot answer: nobody opened this container while it was recorded."""

    start_ns: int
    container: ContainerId


@dataclass(frozen=True, slots=True, kw_only=True)
class Refused:
    """It did not happen, and why. The robot may have moved: travel_m metres and now at `at`."""

    start_ns: int
    end_ns: int
    reason: str
    travel_m: float = 0.0
    path: tuple[Point, ...] = ()
    at: LocationId | None = None


class World(Protocol):
    """What a robot acts in."""

    @property
    def plan(self) -> FloorPlan: ...

    @property
    def travel(self) -> TravelCosts: ...

    @property
    def paths(self) -> Paths: ...

    def now_ns(self) -> int:
        """The world's clock, nanoseconds since the Unix epoch."""
        ...

    def known_at_start(self) -> Contents:
        """What the containers hold that the robot knows before it starts."""
        ...

    def go_to(self, location: LocationId) -> Done | Refused:
        """Walk to a location."""
        ...

    def look_into(self, container: ContainerId) -> Looked | Unseen | Refused:
        """Open or look over the container at which the robot stands; reveals all that it holds."""
        ...

    def pick(self, item: ItemId) -> Done | Refused:
        """Take an item from the location at which the robot stands."""
        ...

    def place(self, item: ItemId) -> Done | Refused:
        """Put the held item down at the location at which the robot stands."""
        ...

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> Done | Refused:
        """Boil, peel, toast, pour-water, make-coffee or pour-coffee with items at hand."""
        ...
