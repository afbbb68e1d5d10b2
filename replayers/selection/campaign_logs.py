"""Recorded trials in the order in which they were driven, in groups that can be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from replayers.batch.compare import runs_once
from replayers.batch.replays import Replays
from replayers.batch.store import StoredReplay
from replayers.runs.run import read
from replayers.selection.trial_costs import TrialCosts, trial_costs
from workbench.errors import BadValue, LiosError
from workbench.remote.path import path_of

BROKE, UNLIKE = "planner-failed", "not-reproduced"


class GroupBy(StrEnum):
    """What trials must have in common to be one campaign; always whether a robot or a simulation was driven."""

    SCENARIO = "scenario"
    SITE = "site"
    """The scenario and the place."""
    TASK = "task"
    """The scenario, the place and the task's own words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialGroup:
    """Trials of one kind, the earliest first.

    Attributes:
        name: what they have in common, in words.
        places: the sites or houses, in the order of first appearance.
        logs: their logs.
        broke: by strategy, the logs on which it broke, and why on the first.
    """

    name: str
    places: tuple[str, ...]
    trials: tuple[TrialCosts, ...]
    logs: tuple[Path, ...]
    broke: dict[str, tuple[tuple[str, ...], str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialGroups:
    """All groups, the largest first.

    Attributes:
        left_out: logs that count for nothing, with the reason, in one line each.
    """

    groups: tuple[TrialGroup, ...]
    left_out: tuple[str, ...]


def group_by(text: str) -> GroupBy:
    """What to group by, by its name.

    Raises:
        BadValue: no such way.
    """
    try:
        return GroupBy(text)
    except ValueError:
        raise BadValue("--group-by", text, "one of " + ", ".join(GroupBy)) from None


def trial_groups(replays: Replays, strategies: Sequence[str], by: GroupBy) -> TrialGroups:
    """The replayed logs as trials in groups. A run that is in several logs counts once; logs of replays count for
    nothing, since nobody drove them."""
    kept, several = runs_once(replays)
    left_out = [s.words if s.kept else f"{s.words}; join them (lios log merge)" for s in several]
    by_log: dict[str, list[StoredReplay]] = {}
    for record in kept:
        by_log.setdefault(record.sha256, []).append(record)
    found: dict[tuple[str, ...], list[tuple[int, Path, str, TrialCosts, list[StoredReplay]]]] = {}
    for records in by_log.values():
        path = path_of(records[0].log)
        try:
            run = read(path)
        except LiosError as error:
            left_out.append(str(error))
            continue
        if run.info.source == "replay":
            left_out.append(f"{path.name} is a recorded replay: nobody drove it")
            continue
        if any(r.status == UNLIKE for r in records):
            left_out.append(f"{path.name}: {next(r.reason for r in records if r.status == UNLIKE)}")
            continue
        driven = "in simulation" if run.info.source == "simulation" else f"by {run.info.source}"
        shared = (run.info.scenario, driven, *_more(by, run.info.place, run.info.title))
        costs = trial_costs(records, strategies, limit=run.task.failure_cost)
        found.setdefault(shared, []).append((run.info.started.ns, path, run.info.place, costs, records))
    groups = [_group(key, sorted(rows, key=lambda row: (row[0], str(row[1])))) for key, rows in found.items()]
    return TrialGroups(
        groups=tuple(sorted(groups, key=lambda g: (-len(g.trials), g.name))),
        left_out=tuple(left_out),
    )


def _more(by: GroupBy, place: str, title: str) -> tuple[str, ...]:
    if by is GroupBy.SCENARIO:
        return ()
    return (f"in {place}",) if by is GroupBy.SITE else (f"in {place}", title)


def _group(key: tuple[str, ...], rows: list[tuple[int, Path, str, TrialCosts, list[StoredReplay]]]) -> TrialGroup:
    broke: dict[str, tuple[tuple[str, ...], str]] = {}
    for _, path, _, _, records in rows:
        for record in records:
            if record.status == BROKE:
                logs, why = broke.get(record.strategy, ((), record.reason))
                broke[record.strategy] = ((*logs, path.name), why)
    return TrialGroup(
        name=", ".join(part for part in key if part),
        places=tuple(dict.fromkeys(place for _, _, place, _, _ in rows)),
        trials=tuple(costs for _, _, _, costs, _ in rows),
        logs=tuple(path for _, path, _, _, _ in rows),
        broke=broke,
    )
