"""Verification: the recorded strategy runs again over its own log and is compared decision by decision.

For a simulated run every observation, belief, find cost, plan and action must come out the same. For a robot's log
the first divergence is named, and why: a container that was skipped, an operator's intervention, another belief. Of a
run that was stopped (by a person, a fault or the clock) what was recorded until then is compared. Stamps, ways and
timings are not compared: they are the robot's, not the strategy's.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest

import msgspec

from recorders.code_revision import revision
from replayers.batch.recorded_strategy import loadable_name
from replayers.counterfactual.evidence import Evidence, evidence_of
from replayers.counterfactual.logged_belief import LoggedBelief, RecordedBeliefs, by_answers, estimator_of
from replayers.counterfactual.reproduction import STOPPED, events_over
from replayers.counterfactual.sandbox import Sandboxed, is_foreign
from replayers.runs.run import Run
from workbench import __version__
from workbench.beliefs.belief import Estimator
from workbench.errors import LiosError, Unsupported
from workbench.execution.events import Event
from workbench.log_schema.codec import to_wire
from workbench.log_schema.events import (
    ActionFinished,
    BeliefUpdate,
    DomainEvent,
    FindCosts,
    ItemSighting,
    Observation,
    Outcome,
    PlanComputed,
)
from workbench.planning.strategies import needs_truth, strategy
from workbench.planning.strategy import Strategy
from workbench.plugins import NameOrigin
from workbench.tolerances import NEAR_ROUNDED

NOT_COMPARED = frozenset({"stamp", "start", "path", "support", "standing", "estimator", "note", "look", "opened_by"})
"""Fields that depend on the world or the machine, or are words for people; not compared."""

MEASURED = NOT_COMPARED | {"cost", "own_cost", "travel_m"}
"""The same for a robot's log: there the walked distance is measured, while a replay reads it off the map."""


FORMER_SOLVERS = {"sas-ff-astar2": "sas-ff-astar", "pddl-ff-astar2": "pddl-ff-astar"}
"""Solvers that once ran another search under the name, with the name which that search has now."""
FORMER_NOTE = "recorded when ff-astar2 was the search that is now ff-astar; verified with {}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Divergence:
    """Where a replay first differs from its log.

    Attributes:
        decision: in which decision; topic: in which kind of event; index: of how many events before.
        field: which field differs; "event" when one side has an event that the other lacks.
        logged, replayed: the two values, shortened.
        why: the likely cause, in words.
    """

    decision: int
    topic: str
    index: int
    field: str
    logged: str
    replayed: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """The result of a verification.

    Attributes:
        same: everything compared is the same.
        decisions, events: how many were compared.
        complete: the log holds its end; otherwise what it holds was compared.
        stopped: why the run was stopped, which no strategy decides, so that only what was recorded before was
            compared; empty where it was not.
    """

    same: bool
    decisions: int
    events: int
    complete: bool
    strategy: str
    divergence: Divergence | None = None
    notes: tuple[str, ...] = ()
    stopped: str = ""


def verify(run: Run, *, strategy_name: str = "", origin: NameOrigin = NameOrigin.LOG) -> Verification:
    """Runs the recorded strategy again and compares.

    Args:
        strategy_name: under which the recorded strategy is found here, where that is not the name in the log: logs
            of "module:Class" hold what the planner calls itself.
        origin: who gives strategy_name. The name in the log is the log's in any case.

    Raises:
        UnknownRecordedStrategy: the strategy is neither built in nor installed here.
        UnknownName, NotFromLog: no strategy of the name given.
        Unsupported: the oracle, and the log was read without its truth.
    """
    evidence = evidence_of(run)
    name = strategy_name or loadable_name(run)
    origin = origin if strategy_name else NameOrigin.LOG
    if needs_truth(name):
        return _compared(run, _with_truth(run, name, origin), ())
    estimator, note = _recorded_estimator(run, evidence)
    notes = tuple(n for n in (*evidence.notes, note) if n)

    def again(planner: Strategy) -> Iterator[Event]:
        return events_over(run, evidence, estimator, planner)

    if is_foreign(name, origin=origin):
        with Sandboxed(name, origin=origin) as planner:
            return _compared(run, tuple(again(planner)), notes)
    verified = _compared(run, again(strategy(name, origin=origin)), notes)
    former = FORMER_SOLVERS.get(name.partition("@")[2])
    if verified.same or former is None:
        return verified
    planner = strategy(f"{name.partition('@')[0]}@{former}", origin=origin)
    earlier = _compared(_with_solver_named(run, former), again(planner), (*notes, FORMER_NOTE.format(former)))
    return earlier if earlier.same else verified


def _with_solver_named(run: Run, name: str) -> Run:
    """The run, its outside plans said to be made by that solver."""
    outside = {*FORMER_SOLVERS}
    return replace(
        run,
        plans=tuple(
            msgspec.structs.replace(plan, solver=name) if plan.solver in outside else plan for plan in run.plans
        ),
    )


def _recorded_estimator(run: Run, evidence: Evidence) -> tuple[Estimator, str]:
    """The estimator of the run, if it is available with the same weights; else its beliefs as logged."""
    recorded = run.info.estimator
    by_the_log = by_answers(evidence)
    if by_the_log is not None:
        return by_the_log, ""
    try:
        found = estimator_of(evidence, recorded.partition("@")[0], NameOrigin.LOG)
    except LiosError:
        found = None
    if found is not None and found.name == recorded:
        return found, ""
    if not evidence.perception.perfect:  # the logged ones are posteriors: the loop makes them of the first ones
        return LoggedBelief(evidence), f"the log's first beliefs: {recorded} is not here"
    return RecordedBeliefs(evidence, run.beliefs), f"beliefs as logged: {recorded} is not here"


def _with_truth(run: Run, name: str, origin: NameOrigin) -> Iterable[Event]:
    from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
    from replayers.counterfactual.replay import in_truth

    if run.truth is None:
        raise Unsupported(f"{run.path}: {name} knows the whole house, and this log holds no ground truth.")
    prepared = prepare_log(run, ReplaySettings(worlds=0, with_truth=True))
    prepared = replace(prepared, estimator=_recorded_estimator(run, prepared.evidence)[0])
    return in_truth(prepared, strategy(name, origin=origin, house=prepared.truth))


def _compared(run: Run, events: Iterable[Event], notes: tuple[str, ...]) -> Verification:
    logged = _in_order(run)
    replayed = (wire for event in events for wire in to_wire(event) if type(wire) in _ORDER)
    ignored = NOT_COMPARED if run.info.source in ("simulation", "replay") else MEASURED
    stopped = run.outcome.reason or run.outcome.status if run.outcome and run.outcome.status in STOPPED else ""
    found = Verification(
        same=True,
        decisions=0,
        events=0,
        complete=run.complete,
        strategy=run.info.strategy,
        notes=notes,
        stopped=stopped,
    )
    for index, (was, now) in enumerate(zip_longest(logged, replayed)):
        if (was is None and run.outcome is None) or (stopped and isinstance(was, Outcome)):
            break
        divergence = _difference(was, now, index, ignored, _recorded_by(run))
        if divergence is not None:
            return replace(found, same=False, divergence=divergence)
        found = replace(found, events=found.events + 1, decisions=found.decisions + isinstance(was, PlanComputed))
    return found


_ORDER: dict[type[DomainEvent], int] = {
    BeliefUpdate: 0,
    FindCosts: 1,
    PlanComputed: 2,
    ActionFinished: 3,
    Observation: 4,
    ItemSighting: 5,
    Outcome: 6,
}


def _in_order(run: Run) -> list[DomainEvent]:
    """The log's events in the order of the loop: by decision, then as the loop yields them."""
    start = sorted((o for o in run.observations if o.known_at_start), key=lambda o: o.container)
    rest: list[tuple[tuple[int, int, int, int], DomainEvent]] = []
    for group in (run.beliefs, run.find_costs, run.plans):
        rest += [((e.decision, 0, 0, _ORDER[type(e)]), e) for e in group]
    rest += [((a.decision, 1, a.stamp.ns, 2 * a.index), a) for a in run.actions]
    searched = {(a.decision, a.target): a.index for a in run.actions if a.action == "search"}
    for o in run.observations:
        if not o.known_at_start:
            after = searched.get((o.decision, o.container), len(run.actions))
            turn = 0 if o.passing is not None else 2 * after + 1  # what is seen in passing, before its move has ended
            rest.append(((o.decision, 1, o.stamp.ns, turn), o))
    rest += [((s.decision, 1, s.stamp.ns, 0), s) for s in run.sightings]
    rest.sort(key=lambda pair: pair[0])
    end = [run.outcome] if run.outcome is not None else []
    return [*start, *(event for _, event in rest), *end]


def _recorded_by(run: Run) -> str:
    """The code version that made the log, if it differs from this one; empty otherwise."""
    here = revision()
    if (run.info.code_revision, run.info.code_version) == (here.commit, __version__) and not run.info.code_dirty:
        return ""
    then = f"{run.info.code_version} {run.info.code_revision[:10]}".strip() or "another release"
    return f" (recorded by {then}{' with changes' if run.info.code_dirty else ''})"


def _difference(
    was: DomainEvent | None, now: DomainEvent | None, index: int, ignored: frozenset[str], recorded_by: str
) -> Divergence | None:
    if was is None or now is None or type(was) is not type(now):
        both = [event for event in (was, now) if event is not None]
        return Divergence(
            decision=min(int(getattr(event, "decision", 0)) for event in both),
            topic=type(both[0]).__name__,
            index=index,
            field="event",
            logged=_short(was),
            replayed=_short(now),
            why=_why(was, now, "event", recorded_by),
        )
    before, after = msgspec.to_builtins(was), msgspec.to_builtins(now)
    for name in before:
        ignore = ignored if isinstance(was, ActionFinished | Outcome) else NOT_COMPARED
        if name not in ignore and not _same(before[name], after[name]):
            return Divergence(
                decision=int(getattr(was, "decision", 0)),
                topic=type(was).__name__,
                index=index,
                field=name,
                logged=_shortened(before[name]),
                replayed=_shortened(after[name]),
                why=_why(was, now, name, recorded_by),
            )
    return None


def _why(was: DomainEvent | None, now: DomainEvent | None, field: str, recorded_by: str) -> str:
    """The likely cause of a divergence, from what differs."""
    if was is None:
        return "the log ends here; the strategy would have gone on"
    if now is None:
        return "the strategy ends here; the robot went on (an operator, or another strategy)"
    if isinstance(now, Outcome) and now.status == "undetermined":
        return f"the strategy looks into {now.unseen}, which the robot skipped"
    if isinstance(was, ActionFinished) and not was.success:
        return f"the robot's {was.action} failed: {was.reason or 'no reason logged'}"
    if isinstance(was, ActionFinished) and isinstance(now, ActionFinished):
        return f"the robot did '{was.action} {was.target}' where the strategy does '{now.action} {now.target}'"
    if isinstance(was, BeliefUpdate):
        return f"the beliefs differ: another estimator, or other weights{recorded_by}"
    if isinstance(was, PlanComputed) and isinstance(now, PlanComputed) and _same_step(was, now):
        return f"the same next step from different figures ({field}): other code, weights or solver{recorded_by}"
    if isinstance(was, FindCosts | PlanComputed):
        return f"the strategy decides differently ({field}): other code, weights or solver{recorded_by}"
    return f"the {field} differs"


def _same_step(was: PlanComputed, now: PlanComputed) -> bool:
    """Whether two plans begin alike: the same first step, and the same first look of its find."""

    def first(plan: PlanComputed) -> tuple[object, ...]:
        step = plan.steps[0] if plan.steps else None
        look = plan.search_order[0].container if plan.search_order else None
        return (step.action, step.target, step.items, look) if step else ()

    return first(was) == first(now)


def _same(a: object, b: object) -> bool:
    if isinstance(a, float | int) and isinstance(b, float | int) and not isinstance(a, bool):
        return abs(a - b) <= NEAR_ROUNDED * max(1.0, abs(a))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[k], b[k]) for k in a)
    if isinstance(a, list | tuple) and isinstance(b, list | tuple):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    return a == b


def _short(event: DomainEvent | None) -> str:
    if event is None:
        return "nothing"
    if isinstance(event, ActionFinished):
        return f"{event.action} {event.target}"
    if isinstance(event, Outcome):
        return f"the end: {event.status}"
    return type(event).__name__


def _shortened(value: object) -> str:
    text = msgspec.json.encode(value).decode()
    return text if len(text) <= 100 else text[:97] + "..."
