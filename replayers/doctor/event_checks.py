"""Checks the events of a run against the house and against each other, streaming, in constant memory.

Costs are compared to 0.01: the log rounds them to six decimals, and they are summed many times.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import isfinite

from replayers.doctor.findings import Findings, Level
from workbench.execution.events import RunStatus
from workbench.log_schema.events import (
    ActionFinished,
    BeliefUpdate,
    DomainEvent,
    FindCosts,
    GroundTruth,
    Observation,
    Outcome,
    PlanComputed,
    Step,
    Timing,
)
from workbench.log_schema.place import Place
from workbench.planning.plans import PlanStatus
from workbench.tolerances import NEAR_LOGGED_SUM, NEAR_PROBABILITY
from workbench.worlds.house import LocationId
from workbench.worlds.sight.sightings import stop_point

CONTINUITY = frozenset({"decisions missing", "actions missing", "robot elsewhere", "against truth"})
"""Kinds of findings that missing events cause: mere warnings where events are known to be missing."""
STATUSES = frozenset(status.value for status in RunStatus)
PLAN_STATUSES = frozenset(status.value for status in PlanStatus)


@dataclass(slots=True)
class EventChecks:
    """Takes the events of one run in order and reports findings."""

    findings: Findings
    place: Place
    own: Findings = field(default_factory=Findings)
    newest_ns: int = 0
    decision: int = 0
    index: int = 0
    robot_at: str | None = None
    searched: set[str] = field(default_factory=set)
    doubted: set[str] = field(default_factory=set)
    """Containers into which looks that can miss were made: beliefs about them go on."""
    handled: set[str] = field(default_factory=set)
    """Items that the robot took or put down: they need not be where the ground truth has them at the start."""
    looks: int = 0
    cost: float = 0.0
    travel_m: float = 0.0
    actions: int = 0
    broken: bool = False
    truth: GroundTruth | None = None
    outcome: Outcome | None = None
    _containers: frozenset[str] = frozenset()
    _locations: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        self._containers = frozenset(c.id for c in self.place.plan.containers)
        self._locations = frozenset(self.place.travel.locations)

    def take(self, event: DomainEvent, *, simulated: bool) -> None:
        if isinstance(event, GroundTruth):
            self.truth = event
            self._known(event.contents, "/search/truth", "contents of")
            return
        if event.stamp.ns < self.newest_ns:
            late_s = (self.newest_ns - event.stamp.ns) / 1e9
            self._error(event, f"its stamp lies {late_s:.3f} s before an earlier event's", "stamps run backward")
        self.newest_ns = max(self.newest_ns, event.stamp.ns)
        if self.outcome is not None and not isinstance(event, Timing):
            self._error(event, "it comes after the run's outcome", "after the outcome")
        match event:
            case Observation():
                self._observed(event, simulated=simulated)
            case BeliefUpdate():
                self._believed(event)
            case FindCosts():
                self._costed(event)
            case PlanComputed():
                self._planned(event)
            case ActionFinished():
                self._acted(event, simulated=simulated)
            case Outcome():
                self._ended(event)
            case _:
                pass

    def finish(self, *, partial: bool) -> None:
        """The checks that need the whole run. Sums are compared only where the log is complete."""
        findings, outcome = self.findings, self.outcome
        self._hand_over(partial=partial)
        if outcome is None:
            level = Level.INFO if partial else Level.WARNING
            findings.add(level, "/search/outcome", "the run has no outcome: the recording stopped before its end")
            return
        if partial:
            return
        for name, said, seen in (
            ("cost", outcome.own_cost, self.cost),
            ("metres walked", outcome.travel_m, self.travel_m),
            ("searches", outcome.searches, self.looks),
        ):
            if abs(said - seen) > NEAR_LOGGED_SUM * max(1.0, abs(said) / 100):
                what = f"its {name}: {said:g}, and the actions add up to {seen:g}"
                findings.error("/search/outcome", what, kind=f"sum of {name}")
        if outcome.status == RunStatus.DONE and abs(outcome.cost - outcome.own_cost) > NEAR_LOGGED_SUM:
            findings.error(
                "/search/outcome", f"done at cost {outcome.cost:g}, but its own cost is {outcome.own_cost:g}"
            )

    def _observed(self, event: Observation, *, simulated: bool) -> None:
        """Looks that can miss may be repeated and show less than is there; on a robot every look may be repeated."""
        self._known((event.container,), _where(event), "observation of")
        held = frozenset(item.id for item in event.items)
        can_miss = event.look is not None
        if event.container in self.searched and simulated and not can_miss:
            self._error(event, f"{event.container} had been searched before", "searched twice")
        self.searched.add(event.container)
        if can_miss:
            self.doubted.add(event.container)
        if self.truth is not None and event.container in self.truth.contents:
            really = frozenset(item.id for item in self.truth.contents[event.container])
            if (held - really if can_miss else held ^ really) - self.handled:
                self._error(event, f"{event.container} does not hold what the ground truth says", "against truth")
        from_afar = event.robot_at != event.container and event.passing is None
        if not event.known_at_start and from_afar:
            self._error(event, f"{event.container} was searched from {event.robot_at}", "searched from afar")

    def _believed(self, event: BeliefUpdate) -> None:
        self._known(event.containers, _where(event), "a belief about")
        shape = (len(event.item_types), len(event.containers))
        rows = {len(row) for row in event.probability}
        if len(event.probability) != shape[0] or (rows and rows != {shape[1]}):
            self._error(event, f"its probabilities are not of shape {shape}", "axes")
        if any(not 0.0 <= p <= 1.0 for row in event.probability for p in row):
            self._error(event, "an entry is no probability", "probability")
        opened = [name for name in event.containers if name in self.searched - self.doubted]
        if opened:
            self._error(event, f"it speaks of {opened[0]}, which had been searched", "belief about searched")
        self._follows(event.decision, event)

    def _costed(self, event: FindCosts) -> None:
        places = [name for name in (*event.origins, *event.targets) if not self._is_location(name)]
        if places:
            self._error(event, f"{places[0]} is no location that the robot can reach", "unknown location")
        layers = [len(layer) == len(event.origins) for layer in event.metres]
        rows = [len(row) == len(event.targets) for layer in event.metres for row in layer]
        if len(event.metres) != len(event.item_types) or not all(layers) or not all(rows):
            self._error(event, "its costs are not of the shape of its axes", "axes")
        if any(not (isfinite(c) and c >= 0) for layer in event.metres for row in layer for c in row):
            self._error(event, "a cost is negative or not finite", "cost")

    def _planned(self, event: PlanComputed) -> None:
        self._follows(event.decision, event)
        if event.status not in PLAN_STATUSES:
            self._error(event, f"unknown plan status {event.status[:40]!r}", "status")
        if self.robot_at is not None and event.robot_at != self.robot_at:
            self._error(
                event, f"the robot is at {event.robot_at}, but had gone to {self.robot_at}", "robot elsewhere"
            )
        self.robot_at = event.robot_at
        self._steps(event)
        self._costs_of(event)
        self._known((stop.container for stop in event.search_order), _where(event), "a search order through")
        if any(
            not 0 <= p <= 1 + NEAR_PROBABILITY
            for stop in event.search_order
            for p in (stop.probability, stop.reached)
        ):
            self._error(event, "a stop of its search order has no probability", "probability")

    def _costs_of(self, event: PlanComputed) -> None:
        expected, total = event.expected_cost, sum(step.cost for step in event.steps)
        if expected is None:
            if event.status == PlanStatus.SOLVED:
                self._error(event, "it is solved, and no cost is expected", "expected cost")
            return
        off = NEAR_LOGGED_SUM * max(1.0, total / 100)
        if event.steps and abs(total - expected) > off:
            self._error(event, f"it expects {expected:g}, and its steps add up to {total:g}", "plan's sum")
        if event.lower_bound is not None and event.lower_bound > expected + off:
            self._error(event, f"its lower bound {event.lower_bound:g} is above its cost", "lower bound")

    def _steps(self, event: PlanComputed) -> None:
        at = event.robot_at
        for step in event.steps:
            if step.origin != at:
                self._error(
                    event, f"step {_shown(step)} begins at {step.origin}, but the robot is at {at}", "plan jumps"
                )
                return
            if not self._is_location(step.target) or step.cost < 0 or not isfinite(step.cost):
                self._error(event, f"step {_shown(step)} leads nowhere or has no cost", "illegal step")
            if step.action == "move":
                metres = self.place.travel.between(LocationId(step.origin), LocationId(step.target))
                if metres is not None and abs(metres - step.cost) > NEAR_LOGGED_SUM * max(1.0, metres / 100):
                    what = f"step {_shown(step)} costs {step.cost:g}, and the way is {metres:g} m"
                    self._error(event, what, "cost of a move")
            elif step.action != "find" and step.origin != step.target:
                self._error(event, f"step {_shown(step)} moves the robot", "illegal step")
            at = step.target

    def _acted(self, event: ActionFinished, *, simulated: bool) -> None:
        if event.start > event.stamp:
            self._error(event, "it ends before it begins", "ends before it begins")
        if self.actions and event.index != self.index + 1:
            self._error(event, f"action {event.index} follows action {self.index}", "actions missing")
        self.index = event.index
        self.actions += 1
        if event.cost < 0 or event.travel_m < 0:
            self._error(event, "a negative cost or way", "cost")
        self.cost += event.cost
        self.travel_m += event.travel_m
        self.looks += event.action == "search"
        self.handled.update(event.items)
        unknown = [name for name in (event.origin, event.target) if not self._is_location(name)]
        if unknown and event.success:
            self._error(event, f"{unknown[0]} is no location that the robot can reach", "unknown location")
        if not event.success:
            self.robot_at = None
            return
        if self.robot_at is not None and event.origin != self.robot_at:
            self._error(event, f"it begins at {event.origin}, but the robot is at {self.robot_at}", "robot elsewhere")
        self.robot_at = event.target
        metres = self.place.travel.between(LocationId(event.origin), LocationId(event.target))
        if (
            simulated
            and event.action == "move"
            and metres is not None
            and abs(metres - event.travel_m) > NEAR_LOGGED_SUM
        ):
            self._error(event, f"it walked {event.travel_m:g} m, and the way is {metres:g} m", "length of a way")
        if any(not isfinite(x) for a, b in pairwise(event.path) for x in (*a, *b)):
            self._error(event, "a point of its path is not finite", "path")

    def _is_location(self, name: str) -> bool:
        """Whether the robot can be there: at a place of the travel costs, or where it stopped for what it passed."""
        return name in self._locations or stop_point(name) is not None

    def _ended(self, event: Outcome) -> None:
        self.outcome = event
        if event.status not in STATUSES:
            self._error(event, f"unknown status {event.status[:40]!r}", "status")
        if event.unseen is not None:
            self._known((event.unseen,), _where(event), "an unseen container")

    def _follows(self, decision: int, event: DomainEvent) -> None:
        if self.decision and decision not in (self.decision, self.decision + 1):
            self._error(event, f"decision {decision} follows decision {self.decision}", "decisions missing")
        self.decision = decision

    def _known(self, containers: Iterable[str], where: str, what: str) -> None:
        for name in containers:
            if name not in self._containers:
                self.findings.error(
                    where, f"{what} {name[:80]!r}, which the house does not have", kind="no such container"
                )

    def _error(self, event: DomainEvent, what: str, kind: str) -> None:
        self.own.error(_where(event), what, kind=kind)

    def _hand_over(self, *, partial: bool) -> None:
        """Adds the collected findings to those of the log, once it is known whether events are missing."""
        for (level, kind), count in self.own.counts.items():
            shown = Level.WARNING if partial and kind in CONTINUITY else level
            self.findings.counts[shown, kind] = self.findings.counts.get((shown, kind), 0) + count
        for kind, finding in self.own.kept_by_kind:
            level = Level.WARNING if partial and kind in CONTINUITY else finding.level
            self.findings.keep(replace(finding, level=level), kind)


def _where(event: DomainEvent) -> str:
    from workbench.log_schema.events import TOPIC_OF

    decision = getattr(event, "decision", None)
    return TOPIC_OF[type(event)] + ("" if decision is None else f" decision {decision}")


def _shown(step: Step) -> str:
    return f"'{step.action} {' '.join(step.items or step.item_types)}'".replace(" '", "'")
