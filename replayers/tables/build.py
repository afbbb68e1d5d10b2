"""Turns a run into tables: one pure function for each table, from events to columns.

Beliefs and find costs, which have most of the rows, are laid out by numpy without a loop over entries.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import atan2
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from replayers.tables.column_types import CategoryColumn, NumberColumn, column_of
from replayers.tables.schemas import NUMBER, SCHEMAS, TIME, WHOLE
from replayers.tables.to_pandas import Columns
from workbench.arrays import Ints32
from workbench.log_schema.events import (
    ActionFinished,
    BeliefUpdate,
    FindCosts,
    Observation,
    Outcome,
    PlanComputed,
    RunInfo,
    Timing,
    Wire,
)

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.Pose_pb2 import Pose
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame


class Source(Protocol):
    """A log from which tables are made."""

    @property
    def info(self) -> RunInfo: ...

    @property
    def log(self) -> str:
        """Its path."""
        ...

    @property
    def complete(self) -> bool: ...

    def events(self, event_class: type[Wire]) -> Sequence[Wire]:
        """All events of a class, in order."""
        ...

    def poses(self) -> Sequence[tuple[int, PoseInFrame]]:
        """(log time in nanoseconds, pose) of /robot/pose."""
        ...


def runs(source: Source) -> Columns:
    info = source.info
    outcome = next(iter(source.events(Outcome)[-1:]), None)
    row = {
        "run_id": info.run_id,
        "path": source.log,
        "started": info.started.ns,
        "complete": source.complete and outcome is not None,
        **{
            name: getattr(info, name)
            for name in ("place", "scenario", "strategy", "estimator", "seed", "title", "source", "origin_run")
        },
        **{
            name: None if outcome is None else getattr(outcome, name)
            for name in ("status", "cost", "own_cost", "searches", "travel_m", "reason")
        },
    }
    return _table("runs", {name: [value] for name, value in row.items()})


def decisions(source: Source) -> Columns:
    plans = source.events(PlanComputed)
    timings = {timing.decision: timing for timing in source.events(Timing)}
    return _table(
        "decisions",
        {
            **_common(source, plans),
            **_fields(plans, "robot_at", "reason", "status", "expected_cost", "lower_bound", "optimal"),
            **_fields(plans, "solver", "note"),
            "steps": [len(plan.steps) for plan in plans],
            "first_step": [plan.steps[0].action if plan.steps else None for plan in plans],
            "look_first": [plan.search_order[0].container if plan.search_order else None for plan in plans],
            "belief_s": [t.belief_s if (t := timings.get(plan.decision)) else None for plan in plans],
            "planning_s": [t.planning_s if (t := timings.get(plan.decision)) else None for plan in plans],
        },
    )


def observations(source: Source) -> Columns:
    seen = source.events(Observation)
    return _table(
        "observations",
        {
            **_common(source, seen),
            **_fields(seen, "container", "robot_at", "known_at_start", "support"),
            "item_types": [[item.type for item in one.items] for one in seen],
            "items": [[item.id for item in one.items] for one in seen],
        },
    )


def beliefs(source: Source) -> Columns:
    updates = source.events(BeliefUpdate)
    return _table(
        "beliefs",
        {
            **_broadcast(
                source, updates, [(u.item_types, u.containers) for u in updates], ("item_type", "container")
            ),
            "probability": _values([update.probability for update in updates]),
            "estimator": CategoryColumn.repeated(
                [u.estimator for u in updates], [_size(u.item_types, u.containers) for u in updates]
            ),
        },
    )


def find_costs(source: Source) -> Columns:
    costs = source.events(FindCosts)
    axes = [(one.item_types, one.origins, one.targets) for one in costs]
    sizes = [_size(*each) for each in axes]
    return _table(
        "find_costs",
        {
            **_broadcast(source, costs, axes, ("item_type", "origin", "target")),
            "cost": _values([one.metres for one in costs]),
            "kind": CategoryColumn.repeated([one.kind for one in costs], sizes),
            "belief_model": CategoryColumn.repeated([one.belief_model for one in costs], sizes),
        },
    )


def plans(source: Source) -> Columns:
    steps = [(plan, i, step) for plan in source.events(PlanComputed) for i, step in enumerate(plan.steps)]
    return _table(
        "plans",
        {
            "run_id": CategoryColumn.repeated([source.info.run_id], [len(steps)]),
            "decision": [plan.decision for plan, _, _ in steps],
            "step": [i for _, i, _ in steps],
            **_fields([step for _, _, step in steps], "action", "origin", "target", "item_types", "items", "cost"),
        },
    )


def actions(source: Source) -> Columns:
    done = source.events(ActionFinished)
    return _table(
        "actions",
        {
            "run_id": CategoryColumn.repeated([source.info.run_id], [len(done)]),
            "start": [one.start.ns for one in done],
            "end": [one.stamp.ns for one in done],
            **_fields(done, "decision", "index", "action", "origin", "target", "item_types", "items", "cost"),
            **_fields(done, "success", "travel_m", "reason", "support"),
        },
    )


def poses(source: Source) -> Columns:
    found = source.poses()
    rows = [_pose(message.pose) for _, message in found]
    x_m, y_m, z_m, yaw_rad = np.array(rows, dtype=np.float64).reshape(-1, 4).T.copy()
    return _table(
        "poses",
        {
            "run_id": CategoryColumn.repeated([source.info.run_id], [len(found)]),
            "stamp": [stamp for stamp, _ in found],
            "frame": [message.frame_id for _, message in found],
            "x_m": NumberColumn(x_m, NUMBER),
            "y_m": NumberColumn(y_m, NUMBER),
            "z_m": NumberColumn(z_m, NUMBER),
            "yaw_rad": NumberColumn(yaw_rad, NUMBER),
        },
    )


def _pose(pose: Pose) -> tuple[float, float, float, float]:
    """Position in metres and yaw in radians."""
    place, q = pose.position, pose.orientation
    x, y, z, w = q.x, q.y, q.z, q.w
    return place.x, place.y, place.z, atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


BUILDERS: Mapping[str, Callable[[Source], Columns]] = MappingProxyType(
    {
        "runs": runs,
        "decisions": decisions,
        "observations": observations,
        "beliefs": beliefs,
        "find_costs": find_costs,
        "plans": plans,
        "actions": actions,
        "poses": poses,
    }
)
"""Table by table, in the order of replayers.tables.schemas."""


def _table(name: str, columns: Mapping[str, Any]) -> Columns:
    """Columns as they are; from lists of values, columns of the types that the table declares."""
    made = ((field.name, field.type, columns[field.name]) for field in SCHEMAS[name])
    return {
        column: values if isinstance(values, CategoryColumn | NumberColumn) else column_of(values, kind)
        for column, kind, values in made
    }


def _common(source: Source, events: Sequence[PlanComputed | Observation]) -> dict[str, Any]:
    return {
        "run_id": CategoryColumn.repeated([source.info.run_id], [len(events)]),
        "decision": [event.decision for event in events],
        "stamp": [event.stamp.ns for event in events],
    }


def _fields(events: Sequence[object], *names: str) -> dict[str, list[Any]]:
    return {name: list(map(attrgetter(name), events)) for name in names}


def _broadcast(
    source: Source,
    events: Sequence[BeliefUpdate | FindCosts],
    axes: Sequence[tuple[Sequence[str], ...]],
    names: Sequence[str],
) -> dict[str, CategoryColumn | NumberColumn]:
    """One row for every entry of every event's array: the columns of its event, and its label on every axis."""
    sizes = [_size(*each) for each in axes]
    decisions = np.array([event.decision for event in events], dtype=np.int64)
    stamps_ns = np.array([event.stamp.ns for event in events], dtype=np.int64)
    columns: dict[str, CategoryColumn | NumberColumn] = {
        "run_id": CategoryColumn.repeated([source.info.run_id], [sum(sizes)]),
        "decision": NumberColumn(np.repeat(decisions, sizes), WHOLE),
        "stamp": NumberColumn(np.repeat(stamps_ns, sizes), TIME),
    }
    for axis, name in enumerate(names):
        columns[name] = _labels(axes, axis)
    return columns


def _labels(axes: Sequence[tuple[Sequence[str], ...]], axis: int) -> CategoryColumn:
    """The labels of one axis for every entry, in C order."""
    words: dict[str, int] = {}
    parts: list[Ints32] = []
    for each in axes:
        codes = np.array([words.setdefault(label, len(words)) for label in each[axis]], dtype=np.int32)
        inner, outer = _size(*each[axis + 1 :]), _size(*each[:axis])
        parts.append(np.tile(np.repeat(codes, inner), outer))
    return CategoryColumn(np.concatenate(parts) if parts else np.zeros(0, dtype=np.int32), tuple(words))


def _values(arrays: Sequence[Any]) -> NumberColumn:
    flat = [np.asarray(array, dtype=np.float64).ravel() for array in arrays]
    return NumberColumn(np.concatenate(flat) if flat else np.zeros(0), NUMBER)


def _size(*axes: Sequence[str]) -> int:
    size = 1
    for axis in axes:
        size *= len(axis)
    return size
