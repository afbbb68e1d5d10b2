"""The World protocol: actions that a robot can request (go, look, pick, place, prepare) and their answers.

The simulation, the Spot robot and a recorded log are three Worlds under the same closed loop. Answers are values;
failure is an answer, not an exception.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from workbench.worlds.geometry import Point
from workbench.worlds.house import ContainerId, Contents, FloorPlan, Item, ItemId, LocationId
from workbench.worlds.travel import Paths, TravelCosts


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionDone:
    """The action succeeded; gives its times and, for a move, the distance in metres and the path.

    Stamps are nanoseconds since the Unix epoch. travel_m is 0 for actions other than moves. support is the evidence
    for the answer: "logged", "implied" or "imputed" in a replay, "" elsewhere.
    """

    start_ns: int
    end_ns: int
    travel_m: float = 0.0
    path: tuple[Point, ...] = ()
    support: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class LookResult:
    """A successful look: the contents of the container, and who opened it; "" where it needs no opening."""

    start_ns: int
    end_ns: int
    container: ContainerId
    items: tuple[Item, ...]
    support: str = ""
    opened_by: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class NotInLog:
    """A log cannot answer: the container was not searched while it was recorded."""

    start_ns: int
    container: ContainerId


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionRefused:
    """The action failed, and why. The robot may have moved by travel_m metres and is now at `at`.

    `item_remains` says of a pick that the item is still there: it was not grasped, and is not gone.
    """

    start_ns: int
    end_ns: int
    reason: str
    travel_m: float = 0.0
    path: tuple[Point, ...] = ()
    at: LocationId | None = None
    item_remains: bool = False


class World(Protocol):
    """An environment in which a robot acts."""

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
        """The contents of the containers that the robot knows before it starts."""
        ...

    def go_to(self, location: LocationId) -> ActionDone | ActionRefused:
        """Go to a location."""
        ...

    def look_into(self, container: ContainerId) -> LookResult | NotInLog | ActionRefused:
        """Search the container at the robot's location, which reveals all its contents."""
        ...

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        """Pick an item at the robot's location."""
        ...

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        """Place the held item at the robot's location."""
        ...

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        """Boil, peel, toast, pour-water, make-coffee or pour-coffee with items in the hand or at the robot's
        location."""
        ...
