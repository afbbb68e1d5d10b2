"""Actions (moves, looks, picks, places) derived from a robot's pose, the tags it sees and its gripper.

A robot that stands still near the standing pose of a location is at that location; items that it sees in a
container meanwhile are the result of a look (looks.py says when another one begins). A gripper that closes has picked
the nearest known item here, and one that opens has placed it here. Used for operator-driven sessions and for imported
bags.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import hypot
from types import MappingProxyType
from typing import final

from recorders.spot.client.odometer import WalkLog
from recorders.spot.session.arrivals import nearest_item, nearest_location
from recorders.spot.session.look_findings import InconclusiveLook, LookFinding, LookJudge
from recorders.spot.session.looks import DWELL_S, LOOK_S, LooksOfVisit, look_made
from recorders.spot.tags.item_places import MARGIN_M, ItemPlaces, Position
from workbench.execution.events import ActionEnded, ContainerObserved, Event, RunEnded, RunStatus
from workbench.execution.goal_check import is_met
from workbench.log_schema.events import NANO
from workbench.planning.plans import PlanStep
from workbench.planning.tasks import AllOf, Task
from workbench.search.costs import ActionCosts
from workbench.worlds.geometry import Point
from workbench.worlds.house import START, Container, ContainerId, Item, ItemId, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.perception import PERFECT, Perception
from workbench.worlds.sites.site import Site
from workbench.worlds.world import LookResult

STILL_M = 0.15
"""A robot that stays within this many metres of a point stands still."""
MAX_SIGHTINGS = 1000
"""Of each item, the sightings of one stay that are kept."""


@final
@dataclass(slots=True, kw_only=True)
class ActionDeriver:
    """Derives events from sensor data; thread-safe.

    Args:
        tell: called with every event, in the order of their ends.
        given_moves: do not derive moves, because they are reported by `moved`.
        closed_needs_word: a closed container in which nothing is seen counts as looked into only if `opened` was
            called during the visit; else nobody knows whether it was open.
        furniture_open: an operator's assurance that all closed furniture was opened before.
        perception: how surely a look shows what is there.
        judge: says which looks are inconclusive; they become no event and are listed in `inconclusive`.
    """

    site: Site
    task: Task
    costs: ActionCosts
    tell: Callable[[Event], None]
    given_moves: bool = False
    judge: LookJudge | None = None
    closed_needs_word: bool = False
    furniture_open: bool = False
    perception: Perception = PERFECT
    inconclusive: list[InconclusiveLook] = field(default_factory=list)
    knowledge: Knowledge = field(init=False)
    cost: float = 0.0
    travel_m: float = 0.0
    searches: int = 0
    steps: int = 0
    visits: int = 0
    _walk: WalkLog = field(default_factory=WalkLog)
    _left_ns: int = 0
    _still_at: Point | None = None
    _still_ns: int = 0
    _tags_here: dict[ItemId, deque[tuple[int, Position]]] = field(default_factory=dict)
    _places: ItemPlaces = field(init=False)
    _holds: bool = False
    _unknown_from: tuple[LocationId, int] | None = None
    _looks: LooksOfVisit = field(default_factory=LooksOfVisit)
    _unknown_put: set[LocationId] = field(default_factory=set[LocationId])
    _doubted_on: tuple[LocationId, int] | None = None
    _opened_on: tuple[LocationId, int] | None = None
    _carried: set[ItemId] = field(default_factory=set)
    _first_ns: int = 0
    _last_ns: int = 0
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.knowledge = knowledge_at_start(self.site.plan, self.site.travel, {})
        self._places = ItemPlaces(self.site.plan, margin_m=MARGIN_M)

    def pose(self, stamp_ns: int, point: Point) -> None:
        """Report the robot's position on the map."""
        with self._lock:
            self._heard(stamp_ns)
            self._walk.add(point)
            still = self._still_at
            if still is None or hypot(point[0] - still[0], point[1] - still[1]) > STILL_M:
                self._look_is_over(stamp_ns)
                self._still_at, self._still_ns = point, stamp_ns
                return
            if stamp_ns - self._still_ns >= DWELL_S * NANO and not self.given_moves:
                self._arrive(nearest_location(self.site, point))
            if stamp_ns - self._still_ns >= LOOK_S * NANO:
                self._look_is_over(stamp_ns)

    def tag(self, stamp_ns: int, number: int, position: Position) -> None:
        """Report a tag seen at a position on the map."""
        with self._lock:
            self._heard(stamp_ns)
            item = self.site.tags.get(number)
            if item is not None:
                self._tags_here.setdefault(item.id, deque(maxlen=MAX_SIGHTINGS)).append((stamp_ns, position))

    def opened(self, stamp_ns: int) -> LocationId | None:
        """Report that the container at hand stands open now; returns it, None if there is none.

        Its look begins now: what was seen before shows the door.
        """
        with self._lock:
            self._heard(stamp_ns)
            at = self.knowledge.robot_at
            if at == START:
                return None
            self._opened_on, self._doubted_on, self._still_ns = (at, self.visits), None, stamp_ns
            self._looks.forget()
            return at

    def holding(self, stamp_ns: int, holds: bool) -> None:
        """Report whether the gripper holds something."""
        with self._lock:
            self._heard(stamp_ns)
            if holds is self._holds:
                return
            self._holds = holds
            if holds:
                self.picked(stamp_ns, stamp_ns)
            else:
                self.placed(stamp_ns, stamp_ns)

    def moved(
        self, start_ns: int, end_ns: int, target: LocationId, *, success: bool = True, reason: str = ""
    ) -> None:
        """Report a move with its goal and result."""
        with self._lock:
            self._heard(end_ns)
            self._look_is_over(start_ns)
            if success and target == self.knowledge.robot_at:
                return
            step = PlanStep(action="move", origin=self.knowledge.robot_at, target=target)
            self._act(step, start_ns, end_ns, cost=self._walk.metres, walked=True, success=success, reason=reason)
            if success:
                self.knowledge = self.knowledge.moved(target)
                self._still_ns, self.visits = end_ns, self.visits + 1

    def picked(self, start_ns: int, end_ns: int) -> None:
        """Report a pick at the current location, of the nearest known item.

        Where no look counts, it is of the nearest item whose tag was seen here. If there is none, nobody knows what
        the robot carries now, and what is seen where it puts that down may be it.
        """
        with self._lock:
            self._look_is_over(end_ns)
            self._arrive_at_hand()
            if self.knowledge.holding is not None:
                return
            at, here = self.knowledge.robot_at, self.knowledge.items_at.get(self.knowledge.robot_at, ())
            item = self._nearest_of(here)
            if item is None and (item := self._seen_without_look()) is None:
                self._unknown_from = (at, self.visits)
                return
            if item not in here:
                there = {**self.knowledge.items_at, at: (*here, item)}
                self.knowledge = replace(self.knowledge, items_at=MappingProxyType(there))
            step = PlanStep(action="pick", origin=at, target=at, item_types=(item.type,), items=(item.id,))
            self._act(step, start_ns, end_ns, cost=self.costs.manipulation)
            self.knowledge = self.knowledge.picked(item)
            self._places.moved(item.id)
            self._carried.add(item.id)

    def placed(self, start_ns: int, end_ns: int) -> None:
        """Report a place at the current location."""
        with self._lock:
            self._look_is_over(start_ns)
            self._arrive_at_hand()
            held, at = self.knowledge.holding, self.knowledge.robot_at
            if held is None:
                if self._unknown_from not in (None, (at, self.visits)):  # not a door's handle that was let go
                    self._unknown_put.add(at)
                self._unknown_from = None
                return
            step = PlanStep(action="place", origin=at, target=at, item_types=(held.type,), items=(held.id,))
            self._act(step, start_ns, end_ns, cost=self.costs.manipulation)
            self.knowledge = self.knowledge.placed()

    def end(self, *, status: RunStatus | None = None, reason: str = "") -> RunEnded:
        """End the session, with the given status or by whether the goal is met."""
        with self._lock:
            self._look_is_over(self._last_ns)
            has_goal = self.task.goal != AllOf(parts=())
            met = not has_goal or is_met(self.task.goal, self.knowledge)
            status = status or (RunStatus.DONE if met else RunStatus.ABORTED)
            reason = reason or (
                ("the goal is met" if has_goal else "recorded") if met else "it ended before the goal"
            )
            done = status is RunStatus.DONE
            ended = RunEnded(
                stamp_ns=self._last_ns,
                decision=0,
                status=status,
                cost=self.cost if done else self.task.failure_cost,
                own_cost=self.cost,
                reason=reason,
                searches=self.searches,
                travel_m=self.travel_m,
            )
            self.tell(ended)
            return ended

    @property
    def hand_full(self) -> bool:
        """Whether the gripper holds something, known or not."""
        return self._holds

    @property
    def walked_m(self) -> float:
        """Length in metres of the whole path, also of what led to no location."""
        return self.travel_m + self._walk.metres

    @property
    def spans_s(self) -> float:
        """Time in seconds between the first and the last report."""
        return (self._last_ns - self._first_ns) / NANO

    def _heard(self, stamp_ns: int) -> None:
        self._first_ns = self._first_ns or stamp_ns
        self._last_ns = max(self._last_ns, stamp_ns)

    def _arrive(self, location: LocationId | None) -> None:
        if location is None or location == self.knowledge.robot_at:
            return
        step = PlanStep(action="move", origin=self.knowledge.robot_at, target=location)
        began = self._left_ns or self._first_ns
        self._act(step, began, self._still_ns, cost=self._walk.metres, walked=True)
        self.knowledge, self.visits = self.knowledge.moved(location), self.visits + 1

    def _arrive_at_hand(self) -> None:
        """Arrive where the robot is, without the usual dwell: it uses its hand there."""
        if not self.given_moves and self._still_at is not None:
            self._arrive(nearest_location(self.site, self._still_at))

    def _look_is_over(self, now_ns: int) -> None:
        """Finish a look: after standing at a container long enough, the items seen in it are its contents."""
        at, robot = self.knowledge.robot_at, self._still_at
        if at == START or robot is None:
            return
        self._looks.begin(self.visits)
        container = self.site.plan.container(ContainerId(at))
        start_ns, before = self._looks.start_ns(self._still_ns), self.knowledge.first_seen.get(container.id)
        if not self._looks.has_ended(start_ns, now_ns, first=before is None):
            return
        items = tuple(self._items_in(container, since_ns=start_ns))
        if before is not None and not self._looks.is_another(robot, items, before):
            return
        if self._is_doubted(container, now_ns, robot, listed=before is None):
            return
        end_ns = now_ns if start_ns > self._still_ns else min(now_ns, start_ns + round(LOOK_S * NANO))
        self._looks.add(robot, end_ns)
        self._observe(LookResult(start_ns=start_ns, end_ns=end_ns, container=container.id, items=items), robot)

    def _observe(self, look: LookResult, robot: Point) -> None:
        """Report a look, and add its contents to the knowledge."""
        container, at = self.site.plan.container(look.container), LocationId(look.container)
        made = look_made(self.perception, self.task, self.knowledge, container, robot, look)
        self.searches += 1
        step = PlanStep(action="search", origin=at, target=at, cost=self.costs.search)
        self._act(step, look.start_ns, look.end_ns, cost=self.costs.search)
        self._places.settle(container.id, (item.id for item in look.items))
        again = frozenset({container.id} & self.knowledge.first_seen.keys())
        self.knowledge = self.knowledge.with_another_look_at(again).seen(container.id, look.items)
        self.tell(
            ContainerObserved(
                stamp_ns=look.end_ns,
                decision=0,
                container=container.id,
                items=look.items,
                robot_at=at,
                opened_by=self._opened_by(container),
                look=made,
            )
        )

    def _is_doubted(self, container: Container, now_ns: int, robot: Point, *, listed: bool) -> bool:
        """Whether the look of this visit is inconclusive; the first time it is listed, if `listed`."""
        visit = (self.knowledge.robot_at, self.visits)
        if visit == self._doubted_on:
            return True
        found = LookFinding.SUPPORTED.result()
        if self.judge is not None:
            found = self.judge.judge(visit[0], self._still_ns, now_ns, robot)
        if found.kind is LookFinding.SUPPORTED and self._may_be_shut(container):
            found = LookFinding.MAY_BE_SHUT.result()
        if found.kind is LookFinding.SUPPORTED and self._may_be_carried(container):
            found = LookFinding.MAY_BE_CARRIED.result()
        if found.kind is LookFinding.SUPPORTED:
            return False
        self._doubted_on = visit
        if listed:
            self.inconclusive.append(
                InconclusiveLook(container=container.id, start_ns=self._still_ns, end_ns=now_ns, reason=found.message)
            )
        return True

    def _may_be_carried(self, container: Container) -> bool:
        at, came_from = self.knowledge.robot_at, self._unknown_from
        unknown = came_from not in (None, (at, self.visits)) or at in self._unknown_put
        return unknown and any(self._items_in(container, since_ns=self._still_ns))

    def _may_be_shut(self, container: Container) -> bool:
        closed = any(entry.closed for entry in self.site.file.containers if entry.id == container.id)
        said = self._opened_on == (self.knowledge.robot_at, self.visits)
        return (
            self.closed_needs_word
            and not self.furniture_open
            and closed
            and not said
            and not any(self._items_in(container, since_ns=self._still_ns))
        )

    def _opened_by(self, container: Container) -> str:
        """Who opened closed furniture for the look of this visit; "" where nobody said so, or nobody had to."""
        if not any(entry.closed for entry in self.site.file.containers if entry.id == container.id):
            return ""
        if self._opened_on == (self.knowledge.robot_at, self.visits):
            return "operator"
        return "operator, before the recording" if self.furniture_open else ""

    def _items_in(self, container: Container, *, since_ns: int) -> Iterable[Item]:
        by_id = {item.id: item for item in self.site.tags.values()}
        stay = {
            name: [position for stamp_ns, position in seen if stamp_ns >= since_ns]
            for name, seen in self._tags_here.items()
            if name not in self._carried
        }
        yield from (by_id[name] for name in self._places.shown_in(container.id, stay))

    def _seen_without_look(self) -> Item | None:
        """The nearest item whose tag was seen in the container at hand, of which no look counts; None if it may have
        been put there by the robot."""
        at = self.knowledge.robot_at
        if at == START or at in self.knowledge.first_seen or at in self._unknown_put:
            return None
        return self._nearest_of(
            tuple(self._items_in(self.site.plan.container(ContainerId(at)), since_ns=self._still_ns))
        )

    def _nearest_of(self, here: tuple[Item, ...]) -> Item | None:
        """The item whose tag was seen last nearest to the robot."""
        if self._still_at is None:
            return None
        return nearest_item(here, self._still_at, {i: seen[-1][1] for i, seen in self._tags_here.items() if seen})

    def _act(
        self,
        step: PlanStep,
        start_ns: int,
        end_ns: int,
        *,
        cost: float,
        walked: bool = False,
        success: bool = True,
        reason: str = "",
    ) -> None:
        travel, path = (self._walk.metres, self._walk.corners()) if walked else (0.0, ())
        if walked:
            last = self._walk.points[-1:]
            self._walk = WalkLog(points=list(last))
        self.steps += 1
        self.cost += cost
        self.travel_m += travel
        self._left_ns = end_ns
        self.tell(
            ActionEnded(
                stamp_ns=end_ns,
                decision=0,
                index=self.steps,
                start_ns=start_ns,
                step=step,
                cost=cost,
                success=success,
                travel_m=travel,
                path=path,
                standing=self.site.paths.standing_pose(step.target),
                items=step.items,
                reason=reason,
            )
        )
