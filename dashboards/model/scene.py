"""The scene of a run at one moment, as a pure function of a timeline and a stamp.

`scene_at` reads the timeline's arrays and answers a frozen `Scene`; the Viser app, the offline page, pictures and
figures all show the same Scene.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dashboards.model.labels import humanize_ids
from dashboards.model.paths.planned_path import rest_of_leg, stops_after
from dashboards.model.perception.belief_after_misses import left_after_misses
from dashboards.model.plan_progress import PlannedStep, progress
from dashboards.model.timeline import DecisionFrame, Timeline
from workbench.arrays import Bools, Floats, Ints8, Ints32
from workbench.log_schema.events import FindCosts, Stop, WayNotTaken
from workbench.worlds.house import LocationId

AUTOMATIC = ""
"""Focuses on the item type that the plan in force finds first."""

Status = Literal["unsearched", "searched", "known", "unreachable"]
STATUSES: tuple[Status, ...] = ("unsearched", "searched", "known", "unreachable")


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotState:
    """Where the robot stands, faces, and what it holds."""

    x_m: float
    y_m: float
    yaw_rad: float
    holding: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One moment of one run.

    Attributes:
        stamp_ns: the moment, in nanoseconds since the epoch; second: seconds since the run's start.
        decision: number of the decision in force, 0 before the first; decisions: how many there are.
        phase, doing: what the robot does, as a kind and in words; reason: why the decision was made, in words.
        focus: the item type whose belief is shown, or "" without beliefs.
        belief: for each container of the plan, its probability for the focus; NaN where there is none. float64 (n,).
        left: for each container, the probability that the focus is there though looks, which may have missed it, did
            not show it; NaN elsewhere. float64 (n,).
        top_belief: the largest probability of the focus in the whole run: the top of the colour scale.
        status: per container an index into STATUSES, int8 (n,).
        holds_focus: for each container, whether an instance of the focus was seen in it. bool (n,).
        unseen: for each container, whether nobody opened it though this run had to (the end of a replay). bool (n,).
        order: for each container, its rank in the intended order of search, 1 first; 0 for none. int32 (n,).
        search_order: the same, as the policy gave it.
        trail: corners of the path walked so far, float64 (m, 2); imputed: for each corner, whether the segment that
            ends there was only assumed, bool (m,). ahead: corners of the planned path, float64 (k, 2).
        steps: the plan with what is done, current and next.
        expected_cost: of the plan from its decision on; cost: so far.
        searches: how many containers the run has looked into, those seen in passing not counted.
        outcome: how the run ended, in a word, why, and the charged cost; "" and None before its end.
    """

    stamp_ns: int
    second: float
    decision: int
    decisions: int
    phase: str
    doing: str
    reason: str
    robot: RobotState
    focus: str
    belief: Floats
    left: Floats
    top_belief: float
    status: Ints8
    holds_focus: Bools
    unseen: Bools
    order: Ints32
    search_order: tuple[Stop, ...]
    trail: Floats
    imputed: Bools
    ahead: Floats
    steps: tuple[PlannedStep, ...]
    expected_cost: float | None
    plan_status: str
    solver: str
    cost: float
    travel_m: float
    searches: int
    find_costs: FindCosts | None
    alternatives: tuple[WayNotTaken, ...]
    outcome: str
    why_ended: str
    charged: float | None


def scene_at(timeline: Timeline, stamp_ns: int, *, focus: str = AUTOMATIC, ahead: bool = True) -> Scene:
    """The run at a moment; before its start and after its end it stands still.

    Args:
        timeline: the run, from timeline_of.
        stamp_ns: nanoseconds since the Unix epoch.
        focus: the item type whose belief is shown; AUTOMATIC follows the plan.
        ahead: whether to find the planned path; the first one loads the compiled search for paths.
    """
    stamp = min(max(stamp_ns, timeline.start_ns), timeline.end_ns)
    second = timeline.seconds(stamp)
    at = timeline.decision_at(stamp)
    frame = timeline.decisions[at] if at >= 0 else None
    plan = frame.plan if frame is not None else None
    shown = focus if focus in timeline.item_types else _automatic_focus(timeline, at)
    robot, trail, imputed, travel_m = _robot(timeline, stamp, second)
    phase, doing = _phase(timeline, stamp)
    searched = timeline.searched_ns <= stamp
    steps = progress(frame, stamp) if frame is not None else ()
    outcome = timeline.run.outcome
    ended = outcome if outcome is not None and stamp >= outcome.stamp.ns else None
    return Scene(
        stamp_ns=stamp,
        second=second,
        decision=frame.number if frame is not None else 0,
        decisions=len(timeline.decisions),
        phase=phase,
        doing=doing,
        reason=humanize_ids(plan.reason, _names(timeline)) if plan is not None else "",
        robot=robot,
        focus=shown,
        belief=_belief(timeline, frame, shown, searched),
        left=left_after_misses(timeline, shown, stamp),
        top_belief=timeline.top_belief.get(shown, 0.0),
        status=_status(timeline, searched),
        holds_focus=_holds(timeline, shown, stamp),
        unseen=_unseen(timeline, stamp),
        order=_order(timeline, frame),
        search_order=plan.search_order if plan is not None else (),
        trail=trail,
        imputed=imputed,
        ahead=_ahead(timeline, frame, steps, robot, stamp) if ahead else np.zeros((0, 2)),
        steps=steps,
        expected_cost=plan.expected_cost if plan is not None and plan.steps else None,
        plan_status=plan.status if plan is not None else "",
        solver=plan.solver if plan is not None else "",
        cost=float(np.interp(second, timeline.cost_s, timeline.cost)),
        travel_m=travel_m,
        searches=int(np.count_nonzero(searched & ~timeline.passed)),
        find_costs=frame.find_costs if frame is not None else None,
        alternatives=plan.alternatives if plan is not None else (),
        outcome=ended.status if ended is not None else "",
        why_ended=humanize_ids(ended.reason, _names(timeline)) if ended is not None else "",
        charged=ended.cost if ended is not None else None,
    )


def _names(timeline: Timeline) -> set[str]:
    """The words that a log uses for things and places."""
    return {*timeline.item_types, *(c.id for c in timeline.plan.containers)}


def _automatic_focus(timeline: Timeline, at: int) -> str:
    """The type of the plan's first find; else of the last decision that had one; else the first type."""
    for i in range(at, -1, -1):
        plan = timeline.decisions[i].plan
        for step in plan.steps if plan is not None else ():
            if step.action == "find" and step.item_types and step.item_types[0] in timeline.top_belief:
                return step.item_types[0]
    return timeline.item_types[0] if timeline.item_types else ""


def _robot(timeline: Timeline, stamp: int, second: float) -> tuple[RobotState, Floats, Bools, float]:
    i = max(0, int(np.searchsorted(timeline.path_s, second, side="right")) - 1)
    here = timeline.path_xy[i]
    if i + 1 < len(timeline.path_s):
        span = timeline.path_s[i + 1] - timeline.path_s[i]
        share = (second - timeline.path_s[i]) / span if span > 0 else 0.0
        here = here + share * (timeline.path_xy[i + 1] - here)
    trail = np.concatenate([timeline.path_xy[: i + 1], here[None]])
    last = min(i + 1, len(timeline.imputed) - 1)
    imputed = np.concatenate([timeline.imputed[: i + 1], timeline.imputed[last : last + 1]])
    held = timeline.held[max(0, bisect_right(timeline.held, stamp, key=lambda h: h[0]) - 1)][1]
    walked = float(timeline.path_m[i] + np.hypot(*(here - timeline.path_xy[i])))
    look = RobotState(x_m=float(here[0]), y_m=float(here[1]), yaw_rad=float(timeline.heading_rad[i]), holding=held)
    return look, trail, imputed, walked


def _phase(timeline: Timeline, stamp: int) -> tuple[str, str]:
    phases = timeline.phases
    i = bisect_right(phases, stamp, key=lambda p: p.start_ns) - 1
    if i < 0:
        return "waiting", "about to start"
    if stamp >= timeline.end_ns:
        return "waiting", "the end"
    return phases[i].name, phases[i].title


def _belief(timeline: Timeline, frame: DecisionFrame | None, focus: str, searched: Bools) -> Floats:
    plan = timeline.plan
    values = np.full(len(plan.containers), np.nan)
    belief = frame.belief if frame is not None else None
    if belief is None and timeline.decisions:
        belief = timeline.decisions[0].belief if frame is None else None
    if belief is None or focus not in belief.item_types:
        return values
    row = dict(zip(belief.containers, belief.probability[belief.item_types.index(focus)], strict=True))
    for i, container in enumerate(plan.containers):
        values[i] = row.get(container.id, np.nan)
    values[searched] = np.nan
    return values


def _status(timeline: Timeline, searched: Bools) -> Ints8:
    status = np.zeros(len(searched), dtype=np.int8)
    place = timeline.run.place
    for i, container in enumerate(place.plan.containers):
        if not place.travel.reaches(LocationId(container.id)):
            status[i] = STATUSES.index("unreachable")
    status[timeline.known] = STATUSES.index("known")
    status[searched] = STATUSES.index("searched")
    return status


def _holds(timeline: Timeline, focus: str, stamp: int) -> Bools:
    shown_ns = timeline.shown_ns.get(focus)
    return np.zeros(len(timeline.known), dtype=np.bool_) if shown_ns is None else shown_ns <= stamp


def _unseen(timeline: Timeline, stamp: int) -> Bools:
    outcome = timeline.run.outcome
    wanted = outcome.unseen if outcome is not None and stamp >= outcome.stamp.ns else None
    return np.array([c.id == wanted for c in timeline.plan.containers], dtype=np.bool_)


def _order(timeline: Timeline, frame: DecisionFrame | None) -> Ints32:
    containers = timeline.plan.containers
    order = np.zeros(len(containers), dtype=np.int32)
    if frame is None or frame.plan is None:
        return order
    rank = {stop.container: i + 1 for i, stop in enumerate(frame.plan.search_order)}
    for i, container in enumerate(containers):
        order[i] = rank.get(container.id, 0)
    return order


def _ahead(
    timeline: Timeline, frame: DecisionFrame | None, steps: tuple[PlannedStep, ...], robot: RobotState, stamp: int
) -> Floats:
    """From the robot along the leg it walks, then along the rest of the plan."""
    if frame is None or frame.plan is None:
        return np.zeros((0, 2))
    here = np.array([[robot.x_m, robot.y_m]])
    walking = next((a for a in frame.actions if a.start.ns <= stamp < a.stamp.ns), None)
    first = next((i for i, s in enumerate(steps) if s.progress != "done"), len(steps))
    if walking is not None and walking.action == "move":
        rest, standing = rest_of_leg(walking, stamp), walking.target
        moved_for_itself = first < len(steps) and steps[first].step.action == "move"
        first += 1 if moved_for_itself else 0
    else:
        arrived = [a.target for a in frame.actions if a.stamp.ns <= stamp and a.success]
        rest, standing = np.zeros((0, 2)), arrived[-1] if arrived else frame.plan.robot_at
    later = timeline.planned_paths.through(stops_after(frame.plan, first, standing))
    return np.concatenate([here, rest, later])
