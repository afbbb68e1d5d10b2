"""The World protocol: actions that a robot can request (go, look, pick, place, prepare) and their answers.

The simulation, the Spot robot and a recorded log are three Worlds under the same closed loop. Answers are values;
failure is an answer, not an exception.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol

from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, Contents, FloorPlan, Item, ItemId, ItemType, LocationId
from workbench.worlds.travel import Paths, TravelCosts


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenInPassing:
    """What an open container showed as the robot passed it, when, from where, and the evidence as of ActionDone."""

    stamp_ns: int
    container: ContainerId
    items: tuple[Item, ...]
    viewpoint: Pose
    support: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemInPassing:
    """An item that the robot saw in a container as it passed, when, and from where; what else is there, it did not
    see. Evidence as of ActionDone."""

    stamp_ns: int
    container: ContainerId
    item: Item
    viewpoint: Pose
    support: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionDone:
    """The action succeeded; gives its times and, for a move, the distance in metres and the path.

    Stamps are nanoseconds since the Unix epoch. travel_m is 0 for actions other than moves. support is the evidence
    for the answer: "logged", "implied" or "imputed" in a replay, "" elsewhere. seen is what came into view on a move,
    items_seen are single items of containers that did not come into view as a whole; ended_at is where the robot
    stopped for it, None where it went to the end.
    """

    start_ns: int
    end_ns: int
    travel_m: float = 0.0
    path: tuple[Point, ...] = ()
    support: str = ""
    seen: tuple[SeenInPassing, ...] = ()
    items_seen: tuple[ItemInPassing, ...] = ()
    ended_at: LocationId | None = None


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
    """A log cannot answer: the container was not searched while it was recorded, nor seen in passing."""

    start_ns: int
    container: ContainerId
    in_passing: bool = False


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

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        """Those of them that the robot sees from its start pose, with that pose."""
        ...

    def go_to(
        self, location: LocationId, *, seeking: Collection[ItemType] | None = None
    ) -> ActionDone | NotInLog | ActionRefused:
        """Go to a location.

        Args:
            seeking: the item types sought, where the robot goes to look into a container: one that sees in passing
                stops where the container or such an item comes into view. None for another reason to go.
        """
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
