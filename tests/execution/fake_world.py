"""A world that answers from the toy house, and that can be made to violate the assumptions."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from toy import toy_house, toy_travel

from workbench.beliefs.belief import Belief
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, ContainerId, Contents, FloorPlan, House, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.travel import TravelCosts
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, NotInLog

SECOND = 1_000_000_000


class StraightPaths:
    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        return ((0.0, 0.0), (1.0, 0.0))

    def standing_pose(self, location: LocationId) -> Pose | None:
        return Pose(x_m=0.0, y_m=0.0)


@dataclass
class FakeWorld:
    """Answers from the toy house. `refuse` maps ("pick", item) and the like to how often it refuses; `item_remains`
    says of refused picks that the item is still there."""

    house: House = field(default_factory=toy_house)
    known: tuple[ContainerId, ...] = ()
    refuse: dict[tuple[str, str], int] = field(default_factory=dict)
    item_remains: bool = False
    unseen: frozenset[ContainerId] = frozenset()
    clock_ns: int = 0
    at: LocationId = START
    places: dict[LocationId, list[Item]] = field(init=False)
    held: Item | None = None
    paths: StraightPaths = field(default_factory=StraightPaths)
    travel: TravelCosts = field(default_factory=toy_travel)

    def __post_init__(self) -> None:
        self.places = {LocationId(c): list(items) for c, items in self.house.contents.items()}

    @property
    def plan(self) -> FloorPlan:
        return self.house.plan

    def now_ns(self) -> int:
        return self.clock_ns

    def known_at_start(self) -> Contents:
        return {c: self.house.contents[c] for c in self.known}

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        return {}

    def go_to(
        self, location: LocationId, *, seeking: Collection[ItemType] | None = None
    ) -> ActionDone | ActionRefused:
        start, metres = self.clock_ns, self.travel.between(self.at, location)
        assert metres is not None
        if self._refuses("move", location):
            return ActionRefused(start_ns=start, end_ns=self._after(1), reason="blocked", travel_m=0.5, at=self.at)
        self.at = location
        return ActionDone(start_ns=start, end_ns=self._after(metres), travel_m=metres)

    def look_into(self, container: ContainerId) -> LookResult | NotInLog | ActionRefused:
        start = self.clock_ns
        if container in self.unseen:
            return NotInLog(start_ns=start, container=container)
        if self._refuses("search", container):
            return ActionRefused(start_ns=start, end_ns=self._after(2), reason="stuck door")
        items = tuple(self.places[LocationId(container)])
        return LookResult(start_ns=start, end_ns=self._after(2), container=container, items=items)

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        start = self.clock_ns
        here = self.places.get(self.at, [])
        found = next((i for i in here if i.id == item), None)
        refuses = self._refuses("pick", item)
        if refuses or found is None:
            remains = refuses and self.item_remains
            return ActionRefused(start_ns=start, end_ns=self._after(5), reason="not there", item_remains=remains)
        here.remove(found)
        self.held = found
        return ActionDone(start_ns=start, end_ns=self._after(5))

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        start = self.clock_ns
        assert self.held is not None
        assert self.held.id == item
        self.places.setdefault(self.at, []).append(self.held)
        self.held = None
        return ActionDone(start_ns=start, end_ns=self._after(5))

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        start = self.clock_ns
        return ActionDone(start_ns=start, end_ns=self._after(5))

    def _refuses(self, action: str, name: str) -> bool:
        left: Mapping[tuple[str, str], int] = self.refuse
        if left.get((action, name), 0) <= 0:
            return False
        self.refuse[(action, name)] -= 1
        return True

    def _after(self, seconds: float) -> int:
        self.clock_ns += round(seconds * SECOND)
        return self.clock_ns


class EvenEstimator:
    """Believes every unsearched container as likely as any other."""

    name = "even@0"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        shape = (len(item_types), len(knowledge.unsearched))
        return Belief(
            item_types=item_types,
            containers=knowledge.unsearched,
            probability=np.full(shape, 0.3),
            estimator=self.name,
        )
