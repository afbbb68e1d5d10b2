"""A run as sorted arrays, from which any moment of it can be looked up at once.

The arrays of a `Timeline` say where the robot was, the cost so far, when each container was searched, and which
decision was in force. `scene_at` looks a moment up in microseconds, forwards or backwards, however long the run.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from dashboards.model.labels import humanize_ids
from dashboards.model.paths.action_path import path_of_actions
from dashboards.model.paths.odometry_path import path_of_poses
from dashboards.model.paths.planned_path import PlannedPaths
from dashboards.model.phases import Phase, phases_of
from dashboards.model.replay_bounds import ReplayBounds
from workbench.arrays import Bools, Floats, Ints
from workbench.log_schema.events import (
    NANO,
    ActionFinished,
    BeliefUpdate,
    FindCosts,
    Observation,
    PlanComputed,
    SeenItem,
)
from workbench.worlds.house import ContainerId, FloorPlan

if TYPE_CHECKING:
    from replayers.runs.run import Run

NEVER = np.iinfo(np.int64).max
"""The stamp of an event that does not happen in a run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DecisionFrame:
    """All that was computed at one decision; parts that the log does not hold are None."""

    number: int
    stamp_ns: int
    plan: PlanComputed | None
    belief: BeliefUpdate | None
    find_costs: FindCosts | None
    actions: tuple[ActionFinished, ...]


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class Timeline:
    """A run as sorted arrays.

    Attributes:
        start_ns, end_ns: the run's first and last moment, in nanoseconds since the epoch.
        actions: in order of their ends.
        decisions: in order of their stamps.
        path_s: seconds since start_ns at each corner of the path, float64 (M,), not decreasing.
        path_xy: the corners in metres on the map, float64 (M, 2); path_m: metres walked at each, float64 (M,).
        heading_rad: the robot's heading while it stands at or leaves corner i, float64 (M,).
        imputed: whether the segment that ends at corner i was assumed by a replay, not walked in a log, bool (M,).
        cost_s, cost: cost so far, piecewise linear, float64 (K,) each.
        searched_ns: for each container of the plan, when it was searched in this run, or NEVER.
        passed: for each container, whether the run saw it in passing instead of searching it, bool (n,).
        known: for each container, whether its contents were known before the run began.
        contents: the contents of each container as first seen; where looks can miss, all that any of them showed.
        shown_ns: for each item type and container, the first look that showed one there, or NEVER; int64 (n,).
        held: (stamp, item type or None), in order.
        phases: in order, without overlaps.
        top_belief: for each item type, the largest probability that it ever had in the run.
    """

    run: Run
    plan: FloorPlan
    start_ns: int
    end_ns: int
    actions: tuple[ActionFinished, ...]
    decisions: tuple[DecisionFrame, ...]
    path_s: Floats
    path_xy: Floats
    path_m: Floats
    heading_rad: Floats
    imputed: Bools
    cost_s: Floats
    cost: Floats
    searched_ns: Ints
    passed: Bools
    known: Bools
    contents: Mapping[str, tuple[SeenItem, ...]]
    shown_ns: Mapping[str, Ints]
    held: tuple[tuple[int, str | None], ...]
    phases: tuple[Phase, ...]
    item_types: tuple[str, ...]
    top_belief: Mapping[str, float]
    counterfactual: ReplayBounds | None
    planned_paths: PlannedPaths = field(repr=False, compare=False)
    decision_ns: tuple[int, ...] = field(repr=False)
    action_ns: tuple[int, ...] = field(repr=False)

    @property
    def duration_s(self) -> float:
        return (self.end_ns - self.start_ns) / NANO

    @property
    def status(self) -> str:
        """How the run ended, in one word; "cut off" when its log stops before the end."""
        return self.run.outcome.status if self.run.outcome is not None else "cut off"

    @property
    def undecided(self) -> tuple[float, float] | None:
        """The least and greatest cost of a replay that its log cannot settle; None where the cost is certain."""
        known = self.counterfactual
        if known is None or known.exact or known.lower is None or known.upper is None:
            return None
        return known.lower, known.upper

    @property
    def ends_unseen(self) -> bool:
        """Whether it is a replay that ended at a container that nobody opened."""
        return self.run.outcome is not None and bool(self.run.outcome.unseen)

    @property
    def task_words(self) -> str:
        """The task in a line."""
        info = self.run.info
        return humanize_ids(self.run.task.title or info.title or info.scenario, self.item_types)

    def seconds(self, stamp_ns: int) -> float:
        """Seconds from the run's start to a stamp."""
        return (stamp_ns - self.start_ns) / NANO

    def stamp(self, second: float) -> int:
        """The stamp in nanoseconds at some seconds after the start."""
        return self.start_ns + round(second * NANO)

    def decision_at(self, stamp_ns: int) -> int:
        """The index in `decisions` of the decision in force, or -1 before the first."""
        return bisect_right(self.decision_ns, stamp_ns) - 1


def timeline_of(run: Run, *, counterfactual: ReplayBounds | None = None) -> Timeline:
    """Turns a run into a timeline; what the log lacks is left empty.

    Args:
        counterfactual: for a replay, the bounds and estimate of its cost.
    """
    plan = run.place.plan
    actions = sorted(run.actions, key=lambda a: (a.stamp.ns, a.index))
    start_ns, end_ns = _span(run, actions)
    decisions = _decisions(run, actions)
    path_s, path_xy, facing, imputed = path_of_actions(run.place, actions, start_ns)
    recorded = path_of_poses(run, start_ns, end_ns)
    if recorded is not None:
        (path_s, path_xy, facing), imputed = recorded, np.zeros(len(recorded[0]), dtype=np.bool_)
    steps = np.hypot(*np.diff(path_xy, axis=0).T) if len(path_xy) > 1 else np.zeros(0)
    cost_s, cost = _costs(actions, start_ns)
    searched, known, contents = _searches(run.observations, plan)
    types = sorted({t for b in run.beliefs for t in b.item_types})
    return Timeline(
        run=run,
        plan=plan,
        start_ns=start_ns,
        end_ns=end_ns,
        actions=tuple(actions),
        decisions=decisions,
        path_s=path_s,
        path_xy=path_xy,
        path_m=np.concatenate([[0.0], np.cumsum(steps)]),
        heading_rad=facing,
        imputed=imputed,
        cost_s=cost_s,
        cost=cost,
        searched_ns=searched,
        passed=_passed(run.observations, plan),
        known=known,
        contents=contents,
        shown_ns=_shown(run.observations, plan, start_ns),
        held=_held(actions, start_ns),
        phases=phases_of(actions, [d.stamp_ns for d in decisions], start_ns, end_ns),
        item_types=tuple(types),
        top_belief=_top_belief(run.beliefs),
        counterfactual=counterfactual,
        planned_paths=PlannedPaths(run.place),
        decision_ns=tuple(d.stamp_ns for d in decisions),
        action_ns=tuple(a.start.ns for a in actions),
    )


def _span(run: Run, actions: Sequence[ActionFinished]) -> tuple[int, int]:
    stamps = [e.stamp.ns for e in (*run.observations, *run.beliefs, *run.plans)]
    stamps += [s for a in actions for s in (a.start.ns, a.stamp.ns)]
    if run.outcome is not None:
        stamps.append(run.outcome.stamp.ns)
    if not stamps:
        stamps = [run.info.started.ns]
    return min(stamps), max(stamps)


def _decisions(run: Run, actions: Sequence[ActionFinished]) -> tuple[DecisionFrame, ...]:
    plans = {p.decision: p for p in run.plans}
    beliefs = {b.decision: b for b in run.beliefs}
    costs = {c.decision: c for c in run.find_costs}
    acted: dict[int, list[ActionFinished]] = {}
    for action in actions:
        acted.setdefault(action.decision, []).append(action)
    frames: list[DecisionFrame] = []
    for number in sorted(plans.keys() | beliefs.keys()):
        first = plans.get(number) or beliefs[number]
        frames.append(
            DecisionFrame(
                number=number,
                stamp_ns=first.stamp.ns,
                plan=plans.get(number),
                belief=beliefs.get(number),
                find_costs=costs.get(number),
                actions=tuple(acted.get(number, ())),
            )
        )
    return tuple(sorted(frames, key=lambda f: (f.stamp_ns, f.number)))


def _costs(actions: Sequence[ActionFinished], start_ns: int) -> tuple[Floats, Floats]:
    seconds, cost = [0.0], [0.0]
    for action in actions:
        seconds += [(action.start.ns - start_ns) / NANO, (action.stamp.ns - start_ns) / NANO]
        cost += [cost[-1], cost[-1] + action.cost]
    return np.maximum.accumulate(np.array(seconds)), np.array(cost)


def _searches(
    observations: Sequence[Observation], plan: FloorPlan
) -> tuple[Ints, Bools, Mapping[str, tuple[SeenItem, ...]]]:
    index: dict[ContainerId, int] = {c.id: i for i, c in enumerate(plan.containers)}
    searched = np.full(len(index), NEVER, dtype=np.int64)
    known = np.zeros(len(index), dtype=np.bool_)
    contents: dict[str, tuple[SeenItem, ...]] = {}
    for seen in observations:
        before = contents.setdefault(seen.container, seen.items)
        if seen.look is not None:
            contents[seen.container] = tuple({item.id: item for item in (*before, *seen.items)}.values())
        i = index.get(ContainerId(seen.container))
        if i is None:
            continue
        if seen.known_at_start:
            known[i] = True
        else:
            searched[i] = min(searched[i], seen.stamp.ns)
    return searched, known, MappingProxyType(contents)


def _passed(observations: Sequence[Observation], plan: FloorPlan) -> Bools:
    passed = {seen.container for seen in observations if seen.passing is not None}
    return np.array([c.id in passed for c in plan.containers], dtype=np.bool_)


def _shown(observations: Sequence[Observation], plan: FloorPlan, start_ns: int) -> Mapping[str, Ints]:
    index: dict[ContainerId, int] = {c.id: i for i, c in enumerate(plan.containers)}
    shown: dict[str, Ints] = {}
    for seen in observations:
        i = index.get(ContainerId(seen.container))
        if i is None:
            continue
        stamp_ns = start_ns if seen.known_at_start else seen.stamp.ns
        for item in seen.items:
            of_type = shown.setdefault(item.type, np.full(len(index), NEVER, dtype=np.int64))
            of_type[i] = min(of_type[i], stamp_ns)
    return MappingProxyType(shown)


def _held(actions: Sequence[ActionFinished], start_ns: int) -> tuple[tuple[int, str | None], ...]:
    held: list[tuple[int, str | None]] = [(start_ns, None)]
    for action in actions:
        if action.success and action.action == "pick":
            held.append((action.stamp.ns, action.item_types[0] if action.item_types else "something"))
        elif action.success and action.action == "place":
            held.append((action.stamp.ns, None))
    return tuple(held)


def _top_belief(beliefs: Sequence[BeliefUpdate]) -> Mapping[str, float]:
    top: dict[str, float] = {}
    for belief in beliefs:
        for item_type, row in zip(belief.item_types, belief.probability, strict=True):
            top[item_type] = max(top.get(item_type, 0.0), max(row, default=0.0))
    return MappingProxyType(top)
