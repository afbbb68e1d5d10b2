"""Tags seen in passing: an item that is looked for, and whose tag the robot sees on its way, ends the walk.

It counts where a replay can tell that it may be seen (workbench/worlds/sight/tags_in_passing.py): in furniture that
needs no opening, which comes into view on the surveyed path, within the radius. Two detections that agree on the
container are needed, since a walking robot's are less sure.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

from bosdyn.client.math_helpers import SE3Pose

from recorders.spot.run.site_tasks import place_of
from recorders.spot.tags.detections import Detector, TagSighting
from recorders.spot.tags.item_places import Position, container_at
from recorders.spot.tags.pictures import items_detector
from workbench.log_schema.events import NANO
from workbench.log_schema.tags_in_passing_json import tags_of
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.sight.tags_in_passing import TagsInPassing, TurningPoint
from workbench.worlds.world import ItemInPassing

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld

EVERY_S, FRESH_S = 0.5, 2.0
"""How often the robot's own detector is asked on a walk, and how old a detection may be."""
DETECTIONS = 2
"""Detections of a tag in one container, at different times, that make it seen there."""
OFF_PATH_M = 1.0
"""A robot that is farther than this from the surveyed path goes round something: what it sees does not count."""


@dataclass(slots=True)
class _Walk:
    """A walk to look into a container, and what was seen on it."""

    origin: LocationId
    target: LocationId
    types: frozenset[ItemType]
    began_ns: int
    in_view: frozenset[ContainerId]
    stamps: dict[tuple[ItemId, ContainerId], set[int]] = field(default_factory=dict)
    seen: ItemInPassing | None = None
    turn: TurningPoint | None = None


@final
class TagWatch:
    """Watches the walks of a run for tags of items that its task needs and of which none is known.

    Args:
        types: the item types that the task is about.
    """

    def __init__(self, world: SpotWorld, paths: TagsInPassing, types: Iterable[ItemType]) -> None:
        self.paths = paths
        self._world = world
        self._types = frozenset(types)
        self._items = {item.id: item for item in world.site.tags.values()}
        self._known = {item.id for items in world.known.values() for item in items}
        self._asks = items_detector(world.site) is Detector.ROBOT
        self._asked_ns = 0
        self._heard: deque[tuple[int, int, Position]] = deque(maxlen=200)
        self._walk: _Walk | None = None

    def pose(self, stamp_ns: int, point: tuple[float, float]) -> None:
        """Not needed (SensorListener)."""

    def holding(self, stamp_ns: int, holds: bool) -> None:
        """Not needed (SensorListener)."""

    def tag(self, stamp_ns: int, number: int, position: Position) -> None:
        """A tag that the session's detector saw, from any thread (SensorListener)."""
        self._heard.append((stamp_ns, number, position))

    def know(self, items: Iterable[ItemId]) -> None:
        """A look has shown these items: nothing is learnt from seeing them again."""
        self._known.update(items)

    def forget(self, item: ItemId) -> None:
        """The item is not where it was known to be."""
        self._known.discard(item)

    def begin(self, origin: LocationId, target: LocationId, seeking: Collection[ItemType] | None) -> None:
        """A walk begins; seeking is None for one that leads to no look, on which nothing counts."""
        self._walk = None
        if seeking is None:
            return
        known = {self._items[name].type for name in self._known if name in self._items}
        self._walk = _Walk(
            origin=origin,
            target=target,
            types=frozenset(seeking) | (self._types - known),
            began_ns=self._world.now_ns(),
            in_view=frozenset(s.container for s in self.paths.in_view(origin, target)),
        )

    def stops(self) -> bool:
        """Whether the robot has come to where it turns for an item that it has seen. Asks the robot's detector, if
        that is due and nothing was seen yet."""
        walk, now = self._walk, self._world.now_ns()
        if walk is None or not walk.in_view:
            return False
        if walk.turn is not None:
            return self._along(walk) >= walk.turn.along_m
        if now - self._asked_ns < round(EVERY_S * NANO):
            return False
        self._asked_ns = now
        for stamp_ns, item, container in self._detections():
            if now - stamp_ns > round(FRESH_S * NANO) or stamp_ns < walk.began_ns:
                continue
            stamps = walk.stamps.setdefault((item.id, container), set())
            stamps.add(stamp_ns)
            if len(stamps) >= DETECTIONS and self._see(walk, item, container, stamp_ns):
                break
        return False

    def end(self, *, turned: bool) -> tuple[tuple[ItemInPassing, ...], LocationId | None]:
        """The item for which the robot turned, which is known from now on, and where; none where it went on to the
        end of its way."""
        walk, self._walk = self._walk, None
        if not turned or walk is None or walk.seen is None or walk.turn is None:
            return (), None
        self._known.add(walk.seen.item.id)
        return (walk.seen,), walk.turn.location

    def _see(self, walk: _Walk, item: Item, container: ContainerId, stamp_ns: int) -> bool:
        """An item was seen, and the robot turns for it at the next point; False if there is none left, or it is away
        from its way."""
        body = self._world.body_pose()
        if body is None:
            return False
        here = Pose(x_m=body.position.x, y_m=body.position.y, yaw_rad=SE3Pose.from_proto(body).rot.to_yaw())
        along_m, away_m = self.paths.along(walk.origin, walk.target, here.point)
        points = self.paths.turning_points(walk.origin, walk.target, container)
        walk.turn = next((point for point in points if point.along_m >= along_m), None)
        if away_m > OFF_PATH_M or walk.turn is None:
            walk.turn = None
            return False
        walk.seen = ItemInPassing(stamp_ns=stamp_ns, container=container, item=item, viewpoint=here)
        return True

    def _along(self, walk: _Walk) -> float:
        """How far the robot is on its way, in metres."""
        body = self._world.body_pose()
        if body is None:
            return 0.0
        return self.paths.along(walk.origin, walk.target, (body.position.x, body.position.y))[0]

    def _detections(self) -> Iterable[tuple[int, Item, ContainerId]]:
        """When a sought item was detected, and in which container that counts."""
        walk, world = self._walk, self._world
        assert walk is not None, "asked on a walk"
        heard = [(s.stamp_ns, s.tag, s.position) for s in self._sightings()] if self._asks else self._take_heard()
        for stamp_ns, number, position in heard:
            item = world.site.tags.get(number)
            if item is None or item.type not in walk.types or item.id in self._known:
                continue
            container = container_at(world.plan, position, margin_m=world.settings.margin_m)
            if container is not None and container in walk.in_view:
                yield stamp_ns, item, container

    def _sightings(self) -> tuple[TagSighting, ...]:
        return tuple(seen for seen in self._world.sightings() or () if seen.reliable)

    def _take_heard(self) -> list[tuple[int, int, Position]]:
        heard: list[tuple[int, int, Position]] = []
        while self._heard:
            heard.append(self._heard.popleft())
        return heard


def tag_watch(world: SpotWorld, types: Iterable[ItemType]) -> TagWatch | None:
    """The watch of a run; None where tags in passing do not count: the settings say so, or the site's travel costs
    were measured, so that no way is known on which something could come into view."""
    site, radius_m = world.site, world.settings.sees_m
    if not radius_m or site.travel_source != "map":
        return None
    closed = {entry.id for entry in site.file.containers if entry.closed}
    return TagWatch(
        world,
        tags_of(place_of(site), radius_m, tuple(c.id for c in site.plan.containers if c.id not in closed)),
        types,
    )
