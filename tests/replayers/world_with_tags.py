"""A simulated world whose robot may or may not see the tags that it passes, drawn by chance, and logs of its runs."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np

from recorders.run_identity import Driver, run_info
from recorders.run_recorder import RunRecorder
from workbench.beliefs.estimators import estimator
from workbench.execution.events import Event, RunEnded
from workbench.execution.loop import outcome_of, run_task
from workbench.log_schema.place import Place
from workbench.log_schema.tags_in_passing_json import tags_of, tags_to_settings
from workbench.planning.strategies import strategy
from workbench.planning.tasks import Task
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, ContainerId, FloorPlan, House, Item, ItemId, ItemType, LocationId
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.sight.tags_in_passing import TagsInPassing
from workbench.worlds.simulated import EPOCH_NS
from workbench.worlds.travel import Paths, TravelCosts
from workbench.worlds.world import ActionDone, ActionRefused, ItemInPassing, LookResult


def tags_in(plan: FloorPlan, radius_m: float, containers: tuple[ContainerId, ...]) -> TagsInPassing:
    """The ways of a robot that turns for tags in these containers."""
    return tags_of(Place.of(plan, navigate(plan)), radius_m, containers)


class WorldWithTags:
    """A World in which the robot sees a tag that is in view on its way with some chance, and turns at a point drawn
    from those where it may. It sees the tags of types that it seeks, and of others of the task that it has not seen.
    """

    def __init__(self, house: House, tags: TagsInPassing, task: Task, *, chance: float, seed: int) -> None:
        self._house, self._tags = house, tags
        self._types = {part.item_type for part in getattr(task.goal, "parts", (task.goal,))}
        self._chance, self._rng = chance, np.random.default_rng(seed)
        self._at, self._now_ns = START, EPOCH_NS
        self._hand: Item | None = None
        self._there = {LocationId(c): list(items) for c, items in house.contents.items()}
        self._known: dict[ItemId, ItemType] = {}
        self._looked: set[ContainerId] = set()

    @property
    def plan(self) -> FloorPlan:
        return self._house.plan

    @property
    def travel(self) -> TravelCosts:
        return self._tags.travel_from(self._at)

    @property
    def paths(self) -> Paths:
        return self._tags

    def now_ns(self) -> int:
        return self._now_ns

    def known_at_start(self) -> Mapping[ContainerId, tuple[Item, ...]]:
        return {}

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        return {}

    def go_to(self, location: LocationId, *, seeking: Collection[ItemType] | None = None) -> ActionDone:
        here, start = self._at, self._now_ns
        metres = self.travel.between(here, location)
        assert metres is not None
        self._now_ns += 10**9
        drawn = None if seeking is None else self._sighting(here, location, frozenset(seeking))
        if drawn is None:
            self._at = location
            return ActionDone(start_ns=start, end_ns=self._now_ns, travel_m=metres)
        container, item, stop, along_m = drawn
        self._at = stop
        self._known[item.id] = item.type
        seen = ItemInPassing(
            stamp_ns=start + 1, container=container, item=item, viewpoint=Pose(x_m=0.0, y_m=0.0, yaw_rad=0.0)
        )
        return ActionDone(start_ns=start, end_ns=self._now_ns, travel_m=along_m, items_seen=(seen,), ended_at=stop)

    def look_into(self, container: ContainerId) -> LookResult:
        self._looked.add(container)
        items = tuple(self._there[LocationId(container)])
        self._known.update({item.id: item.type for item in items})
        self._now_ns += 10**9
        return LookResult(start_ns=self._now_ns, end_ns=self._now_ns, container=container, items=items)

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        here = self._there[self._at]
        self._hand = next(one for one in here if one.id == item)
        here.remove(self._hand)
        return self._handled()

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        assert self._hand is not None
        self._there.setdefault(self._at, []).append(self._hand)
        self._hand = None
        return self._handled()

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        raise AssertionError("no task of these tests prepares anything")

    def _handled(self) -> ActionDone:
        self._now_ns += 10**9
        return ActionDone(start_ns=self._now_ns, end_ns=self._now_ns)

    def _sighting(
        self, here: LocationId, location: LocationId, seeking: frozenset[ItemType]
    ) -> tuple[ContainerId, Item, LocationId, float] | None:
        sought = seeking | (self._types - set(self._known.values()))
        for view in self._tags.in_view(here, location):
            points = self._tags.turning_points(here, location, view.container)
            for item in self._there[LocationId(view.container)]:
                new = item.type in sought and item.id not in self._known and view.container not in self._looked
                if new and points and self._rng.random() < self._chance:
                    turn = points[int(self._rng.integers(len(points)))]
                    return view.container, item, turn.location, turn.walked_m
        return None


def events_with_tags(
    house: House, tags: TagsInPassing, task: Task, strategy_name: str, *, chance: float, seed: int
) -> Iterator[Event]:
    """The events of one run."""
    world = WorldWithTags(house, tags, task, chance=chance, seed=seed)
    return run_task(world, strategy(strategy_name), estimator("counts"), task, costs=SIMULATION_COSTS)


def record_with_tags(
    path: Path, house: House, tags: TagsInPassing, task: Task, strategy_name: str, *, chance: float, seed: int
) -> RunEnded:
    """Record one run; returns its end."""
    driver = Driver(strategy=strategy_name, estimator=estimator("counts").name, seed=0)
    info = run_info(task, driver, id=f"{strategy_name}{seed}", place=house.plan.name, started_ns=EPOCH_NS)
    seen: list[Event] = []
    with RunRecorder(
        path,
        info=info,
        place=Place.of(house.plan, navigate(house.plan)),
        task=task,
        costs=SIMULATION_COSTS,
        force=True,
        paths=tags,
        settings=tags_to_settings(tags),
    ) as recorder:
        for event in events_with_tags(house, tags, task, strategy_name, chance=chance, seed=seed):
            recorder.record(event)
            seen.append(event)
    return outcome_of(seen)
