"""A World that answers from a recorded log: what the log holds, and NotInLog for the rest.

The third World beside the simulation and the robot. Contents are as at the start of the run, map and travel costs
as logged, what was refused is refused again, and every other action succeeds. With a `filling` it is a world that
agrees with the log: containers that nobody opened hold what the filling says, and those answers are tagged
"imputed". It mirrors what the robot knows, so that bounds can be computed at any moment.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import final

from replayers.counterfactual.durations import SIMULATED, Durations
from replayers.counterfactual.evidence import Evidence, evidence_of
from replayers.counterfactual.evidence_rules import IMPLIED, IMPUTED, LOGGED, SeenOnMove
from replayers.runs.run import Run
from workbench.planning.actions import EFFECTS
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, Contents, FloorPlan, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.sight.sightings import SightPaths, UnknownSight, stop_point
from workbench.worlds.sight.tags_in_passing import TagsInPassing
from workbench.worlds.travel import Paths, TravelCosts
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, NotInLog, SeenInPassing

Filling = Callable[[ContainerId, Knowledge], tuple[Item, ...] | None]
"""What a container holds beyond the log, given what the robot knows when it looks: everything in an open one, and
what was overlooked in another; None when it is unknown."""


def unknown_contents(container: ContainerId, knowledge: Knowledge) -> None:
    """The assignment for a log alone: the contents of no open container are known."""
    return


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A move that was asked for; arguments as of World.go_to."""

    target: LocationId
    seeking: Collection[ItemType] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveToLook:
    """A move to look into a container, and what the robot knew before it."""

    before: Knowledge
    move: Move


@final
class LoggedWorld:
    """A World that answers from a log.

    Where the robot sees in passing, what comes into view on a move is answered like a look.

    Attributes:
        unfinished: the move on which a container of unknown contents came into view; None if there is none.
        moves_to_look: where the robot would stop for a tag that it sees in passing, its moves on which it might. It
            sees none on them, except as recorded.

    Args:
        log: a run as read, or its evidence.
        filling: the contents of open containers; by default they are unknown.
        durations: how long actions take; the simulator's by default.
        with_paths: whether moves carry the path walked; finding paths takes time that exploring need not spend.
        paths: what finds them, where several worlds of one log share it.
        knowledge: state from which to continue a run; the start by default.
        turns: where a robot turned for a tag in passing while recording, one on the same way does so too.
        as_recorded: each look shows what the run's own looks showed, one after the other, misses and all; beyond
            them, everything is unknown. For replaying the recorded strategy.
    """

    def __init__(
        self,
        log: Run | Evidence,
        *,
        filling: Filling = unknown_contents,
        durations: Durations = SIMULATED,
        with_paths: bool = True,
        paths: Paths | None = None,
        knowledge: Knowledge | None = None,
        as_recorded: bool = False,
        turns: bool = False,
    ) -> None:
        self.evidence = log if isinstance(log, Evidence) else evidence_of(log)
        self.imputed: dict[ContainerId, tuple[Item, ...]] = {}
        place = self.evidence.place
        self.knowledge = knowledge or knowledge_at_start(place.plan, self.evidence.travel, self.evidence.known)
        self._filling = filling
        self._as_recorded = as_recorded
        self._legs_seen = {seen.way: seen for seen in self.evidence.seen_on_moves.values()} if turns else {}
        self._durations = durations
        self._imputed_items: set[ItemId] = set()
        self.unfinished: Move | None = None
        self._passing = self.evidence.passing
        self._tags = self.evidence.tags
        self._moves = 0
        self.moves_to_look: list[MoveToLook] = []
        own = self._tags or paths or place.paths() if with_paths else paths or NoPaths(self.evidence)
        self._paths = self._passing or own
        self._now_ns = self.evidence.info.started.ns

    @property
    def plan(self) -> FloorPlan:
        return self.evidence.place.plan

    @property
    def travel(self) -> TravelCosts:
        if self._passing is not None:
            return self._passing.travel_from(self.knowledge.robot_at)
        if self._tags is not None:
            return self._tags.travel_from(self.knowledge.robot_at)
        return self.evidence.travel

    @property
    def paths(self) -> Paths:
        return self._paths

    def now_ns(self) -> int:
        return self._now_ns

    def known_at_start(self) -> Contents:
        return self.evidence.known

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        return self.evidence.seen_at_start

    def go_to(
        self, location: LocationId, *, seeking: Collection[ItemType] | None = None
    ) -> ActionDone | NotInLog | ActionRefused:
        here, start, number = self.knowledge.robot_at, self._now_ns, self._moves
        self._moves += 1
        metres = self.travel.between(here, location)
        if metres is None:
            return ActionRefused(start_ns=start, end_ns=start, reason=f"{location} cannot be reached")
        if location in self.evidence.refused_moves:
            return ActionRefused(start_ns=start, end_ns=start, reason=self.evidence.refused_moves[location])
        if self._passing is not None:
            return self._walk(self._passing, Move(target=location, seeking=seeking))
        if self._tags is not None and seeking is not None:
            if self._as_recorded and number in self.evidence.seen_on_moves:
                return self._turned(self._tags, location, metres, self.evidence.seen_on_moves[number])
            seen, before = self._legs_seen.get((here, location)), self.knowledge
            if seen is not None and not any(before.knows(one.item) for one in seen.items):
                return self._turned(self._tags, location, metres, seen)
            self.moves_to_look.append(MoveToLook(before=before, move=Move(target=location, seeking=seeking)))
        path = self._paths.path(here, location) or ()
        self._now_ns += self._durations.move_ns(metres)
        if self._tags is not None and self.knowledge.travel is not self.evidence.travel:
            self.knowledge = replace(self.knowledge, travel=self.evidence.travel)
        self.knowledge = self.knowledge.moved(location)
        support = LOGGED if (here, location) in self.evidence.walked else IMPLIED
        return ActionDone(start_ns=start, end_ns=self._now_ns, travel_m=metres, path=path, support=support)

    def _walk(self, ways: SightPaths, move: Move) -> ActionDone | NotInLog | ActionRefused:
        """Go towards a location and see what is passed."""
        here, start = self.knowledge.robot_at, self._now_ns
        known, supports = self.knowledge, dict[ContainerId, str]()

        def shows(container: ContainerId) -> tuple[Item, ...] | None:
            nonlocal known
            found = self._seen_as_recorded(container) if self._as_recorded else self._contents(container, known)
            if found is None:
                return None
            items, supports[container] = found
            known = known.seen(container, items)
            return items

        walk = ways.walk(
            here,
            move.target,
            seeking=move.seeking,
            known={*known.first_seen, *known.closed, *self.evidence.refused_searches},
            shows=shows,
        )
        if isinstance(walk, UnknownSight):
            self.unfinished = move
            return NotInLog(start_ns=start, container=walk.container, in_passing=True)
        if walk is None:
            return ActionRefused(start_ns=start, end_ns=start, reason=f"{move.target} cannot be reached")
        self._now_ns += self._durations.move_ns(walk.metres)
        self.knowledge = replace(known, travel=ways.travel_from(walk.end)).moved(walk.end)
        seen = tuple(
            SeenInPassing(
                stamp_ns=start + self._durations.move_ns(sighting.along_m),
                container=sighting.container,
                items=items,
                viewpoint=sighting.viewpoint,
                support=supports[sighting.container],
            )
            for sighting, items in walk.seen
        )
        return ActionDone(
            start_ns=start,
            end_ns=self._now_ns,
            travel_m=walk.metres,
            path=walk.path,
            support=LOGGED if (here, walk.end) in self.evidence.walked else IMPLIED,
            seen=seen,
            ended_at=None if walk.end == move.target else walk.end,
        )

    def _turned(self, tags: TagsInPassing, location: LocationId, metres: float, seen: SeenOnMove) -> ActionDone:
        """Go towards a location as far as the robot went when it saw something in passing."""
        here, start = self.knowledge.robot_at, self._now_ns
        points = (p for one in seen.items for p in tags.turning_points(here, location, one.container))
        walked_m = next((p.walked_m for p in points if p.location == seen.end), metres)
        self._now_ns += self._durations.move_ns(walked_m)
        known = self.knowledge
        for one in seen.items:
            known = known.sighted(one.container, one.item)
        self.knowledge = replace(known, travel=tags.travel_from(seen.end)).moved(seen.end)
        return ActionDone(
            start_ns=start,
            end_ns=self._now_ns,
            travel_m=walked_m,
            support=LOGGED,
            items_seen=seen.items,
            ended_at=None if seen.end == location else seen.end,
        )

    def look_into(self, container: ContainerId) -> LookResult | NotInLog | ActionRefused:
        start = self._now_ns
        if self.knowledge.robot_at != container:
            return ActionRefused(start_ns=start, end_ns=start, reason=f"the robot does not stand at {container}")
        if container in self.evidence.refused_searches:
            self._now_ns += self._durations.look_ns
            self.knowledge = self.knowledge.refuse_search(container)
            return ActionRefused(
                start_ns=start, end_ns=self._now_ns, reason=self.evidence.refused_searches[container]
            )
        if self._as_recorded:
            return self._look_as_recorded(container)
        found = self._contents(container, self.knowledge)
        if found is None:
            return NotInLog(start_ns=start, container=container)
        there, support = found
        self._now_ns += self._durations.look_ns
        self.knowledge = self.knowledge.seen(container, there)
        return LookResult(start_ns=start, end_ns=self._now_ns, container=container, items=there, support=support)

    def _contents(self, container: ContainerId, knowledge: Knowledge) -> tuple[tuple[Item, ...], str] | None:
        """The contents that a container shows at a look or in passing, and their support; None where they are
        unknown."""
        inside = self.evidence.contents.get(container)
        support = IMPUTED if inside is None else LOGGED
        doubted = container in self.evidence.doubtful and self.evidence.misses_left(knowledge)
        if inside is None or doubted:
            more = self._filling(container, knowledge)
            if more is None:
                return None
            certain = self.evidence.shown_in(container)
            more = tuple(item for item in more if item not in certain)
            if inside is None or more:
                self.imputed[container] = more
                self._imputed_items |= {item.id for item in more}
                support = IMPUTED
            inside = (*certain, *more)
        return self._now_there(container, inside), support

    def _seen_as_recorded(self, container: ContainerId) -> tuple[tuple[Item, ...], str] | None:
        """What a container showed when it came into view; None where it never did."""
        shown = self.evidence.looks.get(container, ())
        return (self._now_there(container, shown[0]), LOGGED) if shown else None

    def _look_as_recorded(self, container: ContainerId) -> LookResult | NotInLog:
        start, number = self._now_ns, self.knowledge.looks(container)
        looks = self.evidence.looks.get(container, ())
        if number >= len(looks):
            return NotInLog(start_ns=start, container=container)
        self._now_ns += self._durations.look_ns
        again = frozenset({container} & self.knowledge.first_seen.keys())
        self.knowledge = self.knowledge.with_another_look_at(again).seen(container, looks[number])
        return LookResult(
            start_ns=start, end_ns=self._now_ns, container=container, items=looks[number], support=LOGGED
        )

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        start = self._now_ns
        if item in self.evidence.refused_picks:
            remains = item in self.evidence.left
            if not remains:
                self.knowledge = self.knowledge.without_item(item)
            reason = self.evidence.refused_picks[item]
            return ActionRefused(start_ns=start, end_ns=start, reason=reason, item_remains=remains)
        here = self.knowledge.items_at.get(self.knowledge.robot_at, ())
        found = next((i for i in here if i.id == item), None)
        if found is None or self.knowledge.holding is not None:
            why = f"{item} is not here" if found is None else "the hand is not free"
            return ActionRefused(start_ns=start, end_ns=start, reason=why)
        self.knowledge = self.knowledge.picked(found)
        return self._handled("pick", (item,), start)

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        start = self._now_ns
        held = self.knowledge.holding
        if held is None or held.id != item:
            return ActionRefused(start_ns=start, end_ns=start, reason=f"the hand does not hold {item}")
        if stop_point(self.knowledge.robot_at) is not None:
            return ActionRefused(start_ns=start, end_ns=start, reason=f"there is nothing to put {item} on")
        self.knowledge = self.knowledge.placed()
        return self._handled("place", (item,), start)

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        start = self._now_ns
        held = self.knowledge.holding
        here = {i.id for i in self.knowledge.items_at.get(self.knowledge.robot_at, ())} | {held.id if held else ""}
        missing = [item for item in items if item not in here]
        if missing or action not in EFFECTS:
            why = f"{missing[0]} is not at hand" if missing else f"there is no action {action!r}"
            return ActionRefused(start_ns=start, end_ns=start, reason=why)
        prop, index = EFFECTS[action]
        self.knowledge = self.knowledge.with_facts(self.knowledge.facts | {(prop, (items[index],))})
        return self._handled(action, items, start)

    def _handled(self, action: str, items: tuple[ItemId, ...], start: int) -> ActionDone:
        self._now_ns += self._durations.manipulation_ns
        return ActionDone(start_ns=start, end_ns=self._now_ns, support=self._support(action, items))

    def _support(self, action: str, items: tuple[ItemId, ...]) -> str:
        if any(item in self._imputed_items for item in items):
            return IMPUTED
        return LOGGED if (action, self.knowledge.robot_at, items) in self.evidence.done else IMPLIED

    def _now_there(self, container: ContainerId, inside: tuple[Item, ...]) -> tuple[Item, ...]:
        """What the container holds now: its contents at the start, minus what was taken, plus what was put there."""
        if container in self.knowledge.first_seen:
            return self.knowledge.items_at.get(LocationId(container), ())
        if self._tags is not None:  # what was seen in passing may have been taken without a look
            inside = self.knowledge.left_in(container, inside)
        put = self.knowledge.items_at.get(LocationId(container), ())
        ids = {item.id for item in inside}
        return (*inside, *(item for item in put if item.id not in ids))


@final
class NoPaths:
    """A path finder that gives no paths, for runs that need only where the robot stands."""

    def __init__(self, evidence: Evidence) -> None:
        self._standing = evidence.place.standing

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        return None

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self._standing.get(location)
