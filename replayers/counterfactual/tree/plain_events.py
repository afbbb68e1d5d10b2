"""What is done and seen in a run over a plain log, told from the decisions of its first segment (quick_segment.py).

The same actions, looks and end as the closed loop's in the world of that log (logged_world.py), but nobody is asked
again, and what the robot knows is not followed: where a segment was run without events, every step is legal and
nothing is refused. What was believed and planned is left out: nobody who replays asks for it. Tests compare the two.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import final

from replayers.counterfactual.decisions.decided import Decided
from replayers.counterfactual.durations import Durations
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.evidence_rules import IMPLIED, LOGGED
from replayers.counterfactual.run_nodes import Segment
from workbench.execution.events import (
    ActionEnded,
    ContainerObserved,
    Event,
    RunEnded,
    RunStatus,
)
from workbench.execution.in_passing import unknown_in_words
from workbench.execution.run_end import GOAL_MET
from workbench.planning.plans import PlanStep
from workbench.worlds.house import START, ContainerId, Item, ItemId, LocationId
from workbench.worlds.world import NotInLog


def plain_events(evidence: Evidence, first: Segment, *, durations: Durations) -> tuple[Event, ...] | None:
    """Actions, looks and the end of a run from the start up to its first look into an open container, or to its end.

    Args:
        evidence: of a plain log (evidence.is_plain).
        first: the first segment; None is returned where it was run by the closed loop.
        durations: how long actions take.
    """
    if not first.without_events:
        return None
    unseen = first.unobserved.container if first.unobserved is not None else None
    return tuple(_PlainRun(evidence, durations, evidence.info.started.ns).events(first.decided, unseen))


@final
@dataclass(slots=True)
class _PlainRun:
    """A run as far as it was told.

    Attributes:
        put_down: what the robot put where.
    """

    evidence: Evidence
    durations: Durations
    now_ns: int
    robot_at: LocationId = START
    held: Item | None = None
    put_down: dict[LocationId, tuple[Item, ...]] = field(default_factory=dict[LocationId, tuple[Item, ...]])
    decision: int = 0
    steps: int = 0
    searches: int = 0
    cost: float = 0.0
    travel_m: float = 0.0

    def events(self, decided: Sequence[Decided], unseen: ContainerId | None) -> Iterator[Event]:
        for container, items in sorted(self.evidence.known.items()):
            yield ContainerObserved(
                stamp_ns=self.now_ns,
                decision=0,
                container=container,
                items=tuple(items),
                robot_at=START,
                known_at_start=True,
                passing_from=self.evidence.seen_at_start.get(container),
            )
        for one in decided:
            self.decision += 1
            for step in one.steps:
                yield self._walk(step) if step.action == "move" else self._handle(step)
            if one.look is not None:
                yield from self._look(one.look)
        yield self._ended(unseen)

    def _look(self, container: ContainerId) -> Iterator[Event]:
        place = LocationId(container)
        if self.robot_at != place:
            metres = self.evidence.travel.between(self.robot_at, place) or 0.0
            yield self._walk(PlanStep(action="move", origin=self.robot_at, target=place, cost=metres))
        inside = self.evidence.contents.get(container)
        if inside is None:
            return
        step = PlanStep(action="search", origin=place, target=place, cost=self.evidence.costs.search)
        self.searches += 1
        yield self._acted(step, self.evidence.costs.search, self.durations.look_ns, support=LOGGED)
        ids = {item.id for item in inside}
        items = (*inside, *(item for item in self.put_down.get(place, ()) if item.id not in ids))
        yield ContainerObserved(
            stamp_ns=self.now_ns,
            decision=self.decision,
            container=container,
            items=items,
            robot_at=place,
            support=LOGGED,
        )

    def _walk(self, step: PlanStep) -> ActionEnded:
        metres = self.evidence.travel.between(self.robot_at, step.target) or 0.0
        support = LOGGED if (self.robot_at, step.target) in self.evidence.walked else IMPLIED
        self.robot_at = step.target
        self.travel_m += metres
        return self._acted(step, metres, self.durations.move_ns(metres), support=support, travel_m=metres)

    def _handle(self, step: PlanStep) -> ActionEnded:
        at = self.robot_at
        if step.action == "pick":
            self.held = self._item_here(step.items[0])
            self.put_down[at] = tuple(item for item in self.put_down.get(at, ()) if item is not self.held)
        elif self.held is not None:
            self.put_down[at] = (*self.put_down.get(at, ()), self.held)
            self.held = None
        support = LOGGED if (step.action, at, step.items) in self.evidence.done else IMPLIED
        return self._acted(step, self.evidence.costs.manipulation, self.durations.manipulation_ns, support=support)

    def _item_here(self, item_id: ItemId) -> Item:
        inside = self.evidence.contents.get(ContainerId(self.robot_at), ())
        return next(item for item in (*self.put_down.get(self.robot_at, ()), *inside) if item.id == item_id)

    def _acted(
        self, step: PlanStep, cost: float, took_ns: int, *, support: str, travel_m: float = 0.0
    ) -> ActionEnded:
        start = self.now_ns
        self.now_ns += took_ns
        self.cost += cost
        self.steps += 1
        return ActionEnded(
            stamp_ns=self.now_ns,
            decision=self.decision,
            index=self.steps,
            start_ns=start,
            step=step,
            cost=cost,
            success=True,
            travel_m=travel_m,
            standing=self.evidence.place.standing.get(step.target),
            items=step.items,
            support=support,
        )

    def _ended(self, unseen: ContainerId | None) -> RunEnded:
        status, reason = RunStatus.DONE, GOAL_MET
        if unseen is not None:
            status = RunStatus.UNDETERMINED
            reason = unknown_in_words(NotInLog(start_ns=self.now_ns, container=unseen), LocationId(unseen))
        return RunEnded(
            stamp_ns=self.now_ns,
            decision=self.decision,
            status=status,
            cost=self.cost,
            own_cost=self.cost,
            reason=reason,
            searches=self.searches,
            travel_m=self.travel_m,
            unseen=unseen,
        )
