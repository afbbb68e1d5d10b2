"""How does a run become tables? One pure function a table, from wire events to Arrow columns.

Beliefs and find costs, where the rows are, are laid out by numpy; nothing is looped over entry by entry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import atan2
from types import MappingProxyType
from typing import Any, Protocol

import msgspec
import numpy as np
import numpy.typing as npt
import pyarrow as pa

from replayers.columns import SCHEMAS, TIME, WORD
from workbench.runs.vocabulary import (
    ActionFinished,
    BeliefUpdate,
    FindCosts,
    Observation,
    Outcome,
    PlanComputed,
    RunInfo,
    Stamp,
    Timing,
)


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

    def events(self, event_class: type[msgspec.Struct]) -> Sequence[Any]:
        """All events of a class, in order."""
        ...

    def poses(self) -> Sequence[tuple[int, Any]]:
        """(log time, foxglove.PoseInFrame) of /robot/pose."""
        ...


def runs(source: Source) -> pa.Table:
    info = source.info
    outcome: Outcome | None = next(iter(source.events(Outcome)[-1:]), None)
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


def decisions(source: Source) -> pa.Table:
    plans: Sequence[PlanComputed] = source.events(PlanComputed)
    timings: dict[int, Timing] = {timing.decision: timing for timing in source.events(Timing)}
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


def observations(source: Source) -> pa.Table:
    seen: Sequence[Observation] = source.events(Observation)
    return _table(
        "observations",
        {
            **_common(source, seen),
            **_fields(seen, "container", "robot_at", "known_at_start", "support"),
            "item_types": [[item.type for item in one.items] for one in seen],
            "items": [[item.id for item in one.items] for one in seen],
        },
    )


def beliefs(source: Source) -> pa.Table:
    updates: Sequence[BeliefUpdate] = source.events(BeliefUpdate)
    return _table(
        "beliefs",
        {
            **_spread(source, updates, [(u.item_types, u.containers) for u in updates], ("item_type", "container")),
            "probability": _values([update.probability for update in updates]),
            "estimator": _repeated(
                [u.estimator for u in updates], [_size(u.item_types, u.containers) for u in updates]
            ),
        },
    )


def find_costs(source: Source) -> pa.Table:
    costs: Sequence[FindCosts] = source.events(FindCosts)
    axes = [(one.item_types, one.origins, one.targets) for one in costs]
    sizes = [_size(*each) for each in axes]
    return _table(
        "find_costs",
        {
            **_spread(source, costs, axes, ("item_type", "origin", "target")),
            "cost": _values([one.metres for one in costs]),
            "kind": _repeated([one.kind for one in costs], sizes),
            "belief_model": _repeated([one.belief_model for one in costs], sizes),
        },
    )


def plans(source: Source) -> pa.Table:
    steps = [(plan, i, step) for plan in source.events(PlanComputed) for i, step in enumerate(plan.steps)]
    return _table(
        "plans",
        {
            "run_id": _repeated([source.info.run_id], [len(steps)]),
            "decision": [plan.decision for plan, _, _ in steps],
            "step": [i for _, i, _ in steps],
            **_fields([step for _, _, step in steps], "action", "origin", "target", "item_types", "items", "cost"),
        },
    )


def actions(source: Source) -> pa.Table:
    done: Sequence[ActionFinished] = source.events(ActionFinished)
    return _table(
        "actions",
        {
            "run_id": _repeated([source.info.run_id], [len(done)]),
            "start": [one.start.ns for one in done],
            "end": [one.stamp.ns for one in done],
            **_fields(done, "decision", "index", "action", "origin", "target", "item_types", "items", "cost"),
            **_fields(done, "success", "travel_m", "reason", "support"),
        },
    )


def poses(source: Source) -> pa.Table:
    found = source.poses()
    places = [message.pose.position for _, message in found]
    turns = [message.pose.orientation for _, message in found]
    return _table(
        "poses",
        {
            "run_id": _repeated([source.info.run_id], [len(found)]),
            "stamp": [stamp for stamp, _ in found],
            "frame": [message.frame_id for _, message in found],
            "x_m": [place.x for place in places],
            "y_m": [place.y for place in places],
            "z_m": [place.z for place in places],
            "yaw_rad": [atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z)) for q in turns],
        },
    )


BUILDERS: Mapping[str, Callable[[Source], pa.Table]] = MappingProxyType(
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
"""Table by table, in the order of replayers.columns."""


def _table(name: str, columns: Mapping[str, Any]) -> pa.Table:
    schema = SCHEMAS[name]
    arrays = [_array(columns[field.name], field.type) for field in schema]
    return pa.Table.from_arrays(arrays, schema=schema)


def _array(values: Any, kind: pa.DataType) -> pa.Array:
    if isinstance(values, pa.Array):
        return values
    if kind == WORD:
        return pa.array(values, type=pa.string()).dictionary_encode()
    return pa.array(values, type=kind)


def _common(source: Source, events: Sequence[Any]) -> dict[str, Any]:
    return {
        "run_id": _repeated([source.info.run_id], [len(events)]),
        "decision": [event.decision for event in events],
        "stamp": [event.stamp.ns for event in events],
    }


def _fields(events: Iterable[Any], *names: str) -> dict[str, list[Any]]:
    events = list(events)
    return {name: [getattr(event, name) for event in events] for name in names}


def _spread(
    source: Source, events: Sequence[Any], axes: Sequence[tuple[Sequence[str], ...]], names: Sequence[str]
) -> dict[str, Any]:
    """One row for every entry of every event's array: its event's columns, and the label on every axis."""
    sizes = [_size(*each) for each in axes]
    stamps: list[Stamp] = [event.stamp for event in events]
    columns: dict[str, Any] = {
        "run_id": _repeated([source.info.run_id], [sum(sizes)]),
        "decision": pa.array(np.repeat(np.array([e.decision for e in events], dtype=np.int64), sizes)),
        "stamp": pa.array(np.repeat(np.array([s.ns for s in stamps], dtype=np.int64), sizes)).view(TIME),
    }
    for axis, name in enumerate(names):
        columns[name] = _labels(axes, axis)
    return columns


def _labels(axes: Sequence[tuple[Sequence[str], ...]], axis: int) -> pa.Array:
    """The labels of one axis for every entry, C order, as a dictionary array."""
    words: dict[str, int] = {}
    parts: list[npt.NDArray[np.int32]] = []
    for each in axes:
        codes = np.array([words.setdefault(label, len(words)) for label in each[axis]], dtype=np.int32)
        inner, outer = _size(*each[axis + 1 :]), _size(*each[:axis])
        parts.append(np.tile(np.repeat(codes, inner), outer))
    codes = np.concatenate(parts) if parts else np.zeros(0, dtype=np.int32)
    return pa.DictionaryArray.from_arrays(pa.array(codes), pa.array(list(words), type=pa.string()))


def _values(arrays: Sequence[Any]) -> pa.Array:
    flat = [np.asarray(array, dtype=np.float64).ravel() for array in arrays]
    return pa.array(np.concatenate(flat) if flat else np.zeros(0))


def _repeated(words: Sequence[str], counts: Sequence[int]) -> pa.Array:
    known: dict[str, int] = {}
    codes = np.array([known.setdefault(word, len(known)) for word in words], dtype=np.int32)
    return pa.DictionaryArray.from_arrays(pa.array(np.repeat(codes, counts)), pa.array(list(known), type=pa.string()))


def _size(*axes: Sequence[str]) -> int:
    size = 1
    for axis in axes:
        size *= len(axis)
    return size
