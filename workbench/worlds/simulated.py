"""The simulated world, which executes actions on a house with known contents.

Every action succeeds if its preconditions hold: travel takes 1 s per metre, a look 2 s, a manipulation 5 s. The
clock starts at a fixed epoch and advances only with actions, so that the same actions give the same stamps.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol, final

from workbench.errors import BadValue, UnknownName
from workbench.worlds.geometry import Pose
from workbench.worlds.house import (
    START,
    ContainerId,
    Contents,
    FloorPlan,
    House,
    Item,
    ItemId,
    ItemType,
    LocationId,
)
from workbench.worlds.sight.sightings import SightPaths, Walk, stop_point
from workbench.worlds.travel import Paths, TravelCosts
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, SeenInPassing

EPOCH_NS = 1_767_225_600_000_000_000
"""2026-01-01T00:00:00Z."""
NS_PER_S = 1_000_000_000
METRE_S, LOOK_S, HANDLE_S = 1.0, 2.0, 5.0


class NavigationPaths(Paths, Protocol):
    """The part of Navigation that the simulated world needs."""

    @property
    def travel(self) -> TravelCosts: ...


@final
class SimulatedWorld:
    """A simulated house. Implements World.

    Args:
        house: the true house.
        navigation: its travel costs and paths.
        known: containers whose contents the robot knows before it starts.
        miss_rate: the chance that a look misses an item, drawn for each item and look; one in passing is a look, the
            view from the start pose misses nothing.
        seed: of those draws.
        passing: the ways of a robot that sees open furniture in passing; None for one that does not.
        start_ns: when the run begins, in nanoseconds since the Unix epoch.

    Raises:
        UnknownName: a known container that is not in the house.
        BadValue: a miss rate outside [0, 1).
    """

    def __init__(
        self,
        house: House,
        navigation: NavigationPaths,
        *,
        known: Iterable[ContainerId] = (),
        miss_rate: float = 0.0,
        seed: int = 0,
        passing: SightPaths | None = None,
        start_ns: int = EPOCH_NS,
    ) -> None:
        if not 0 <= miss_rate < 1:
            raise BadValue("miss rate", miss_rate, "at least 0 and below 1")
        self._miss_rate, self._seed = miss_rate, seed
        self._looks: Counter[ContainerId] = Counter()
        self._house = house
        self._navigation = navigation
        self._passing = passing
        self._known = tuple(dict.fromkeys(known))
        for container in self._known:
            if container not in house.contents:
                raise UnknownName("container", container, house.contents, house.plan.name)
        self._seen = set(self._known)
        self._at_start: dict[ContainerId, Pose] = {}
        for sighting in () if self._passing is None else self._passing.at_start():
            if sighting.container not in self._seen:
                self._at_start[sighting.container] = sighting.viewpoint
        self._seen |= self._at_start.keys()
        self._now_ns = start_ns
        self._at: LocationId = START
        self._hand: Item | None = None
        self._there: dict[LocationId, list[Item]] = {LocationId(c): list(i) for c, i in house.contents.items()}

    @property
    def plan(self) -> FloorPlan:
        return self._house.plan

    @property
    def travel(self) -> TravelCosts:
        return self._navigation.travel if self._passing is None else self._passing.travel_from(self._at)

    @property
    def paths(self) -> Paths:
        return self._passing or self._navigation

    def now_ns(self) -> int:
        """The world's clock, nanoseconds since the Unix epoch."""
        return self._now_ns

    def known_at_start(self) -> Contents:
        """The contents of the known containers, in the given order, and of what is seen from the start pose."""
        return {container: self._house.contents[container] for container in (*self._known, *self._at_start)}

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        return MappingProxyType(self._at_start)

    def go_to(
        self, location: LocationId, *, seeking: Collection[ItemType] | None = None
    ) -> ActionDone | ActionRefused:
        """Go to a location along the shortest path; refused if there is none."""
        if self._passing is not None:
            return self._walk(self._passing, location, seeking)
        metres = self.travel.between(self._at, location)
        path = self.paths.path(self._at, location)
        if metres is None or path is None:
            return self._refuse(f"no way from {self._at} to {location}")
        self._at = location
        return self._done(metres * METRE_S, travel_m=metres, path=path)

    def _walk(
        self, paths: SightPaths, location: LocationId, seeking: Collection[ItemType] | None
    ) -> ActionDone | ActionRefused:
        """Go towards a location and see what is passed."""
        walk = paths.walk(
            self._at,
            location,
            seeking=seeking,
            known=self._seen,
            shows=self._shown,
        )
        if not isinstance(walk, Walk):
            return self._refuse(f"no way from {self._at} to {location}")
        start_ns, self._at = self._now_ns, walk.end
        self._seen.update(sighting.container for sighting, _ in walk.seen)
        done = self._done(walk.metres * METRE_S, travel_m=walk.metres, path=walk.path)
        seen = tuple(
            SeenInPassing(
                stamp_ns=start_ns + round(sighting.along_m * METRE_S * NS_PER_S),
                container=sighting.container,
                items=items,
                viewpoint=sighting.viewpoint,
            )
            for sighting, items in walk.seen
        )
        return replace(done, seen=seen, ended_at=None if walk.end == location else walk.end)

    def look_into(self, container: ContainerId) -> LookResult | ActionRefused:
        """The current contents of the container; the robot must stand at it."""
        if container not in self._house.contents:
            return self._refuse(f"no container {container}")
        if self._at != LocationId(container):
            return self._refuse(f"the robot stands at {self._at}, not at {container}")
        done = self._done(LOOK_S)
        items = self._shown(container)
        self._seen.add(container)
        return LookResult(start_ns=done.start_ns, end_ns=done.end_ns, container=container, items=items)

    def _shown(self, container: ContainerId) -> tuple[Item, ...]:
        """What one more look into a container shows."""
        look, self._looks[container] = self._looks[container], self._looks[container] + 1
        return tuple(
            item
            for item in self._there[LocationId(container)]
            if not is_missed(item.id, container, look=look, rate=self._miss_rate, seed=self._seed)
        )

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        """Pick an item at the robot's location; the hand must be free."""
        if self._hand is not None:
            return self._refuse(f"the hand holds {self._hand.id}")
        here = self._there.setdefault(self._at, [])
        for index, there in enumerate(here):
            if there.id == item:
                self._hand = here.pop(index)
                return self._done(HANDLE_S)
        return self._refuse(f"no {item} at {self._at}")

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        """Place the held item at the robot's location."""
        if self._hand is None or self._hand.id != item:
            return self._refuse(f"the hand does not hold {item}")
        if stop_point(self._at) is not None:
            return self._refuse(f"there is nothing to put {item} on")
        self._there.setdefault(self._at, []).append(self._hand)
        self._hand = None
        return self._done(HANDLE_S)

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        """Prepare items that are in the hand or at the robot's location."""
        at_hand = {item.id for item in self._there.get(self._at, ())}
        if self._hand is not None:
            at_hand.add(self._hand.id)
        missing = [item for item in items if item not in at_hand]
        if missing:
            return self._refuse(f"{action} needs {', '.join(missing)} at {self._at}")
        return self._done(HANDLE_S)

    def _done(
        self, seconds: float, *, travel_m: float = 0.0, path: tuple[tuple[float, float], ...] = ()
    ) -> ActionDone:
        start = self._now_ns
        self._now_ns = start + round(seconds * NS_PER_S)
        return ActionDone(start_ns=start, end_ns=self._now_ns, travel_m=travel_m, path=path)

    def _refuse(self, reason: str) -> ActionRefused:
        return ActionRefused(start_ns=self._now_ns, end_ns=self._now_ns, reason=reason)


def is_missed(item: ItemId, container: ContainerId, *, look: int, rate: float, seed: int) -> bool:
    """Whether a look into a container misses an item: the same for the same seed, item and look.

    Args:
        look: number of earlier looks into that container.
        rate: the chance that a look misses an item, in [0, 1).
    """
    if not rate:
        return False
    drawn = f"{seed}|{look}|{container}|{item}"
    chance = int.from_bytes(hashlib.blake2b(drawn.encode(), digest_size=8).digest(), "big") / 2.0**64
    return chance < rate
