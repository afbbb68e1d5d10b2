"""Recorded trials in the order in which they were driven, in groups that can be compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType

from replayers.batch.beliefs_apart import estimator_labels, estimators_in
from replayers.batch.compare import MAX_NAMED, runs_once
from replayers.batch.replays import Replays
from replayers.batch.store import StoredReplay
from replayers.runs.run import read
from replayers.selection.trial_costs import TrialCosts, trial_costs
from workbench.errors import BadValue, LiosError, first_few
from workbench.remote.path import path_of

UNLIKE = "not-reproduced"


class GroupBy(StrEnum):
    """What trials must have in common to be one campaign; always whether a robot or a simulation was driven, and
    whose beliefs a candidate follows."""

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
        beliefs: whose beliefs the candidates follow, where that tells this group from another; otherwise empty.
        places: the sites or houses, in the order of first appearance.
        logs: their logs.
        broke: candidates that are left out of the choice here: the logs on which each broke or could not be replayed,
            and why on the first. The trials are of the others.
    """

    name: str
    beliefs: str
    places: tuple[str, ...]
    trials: tuple[TrialCosts, ...]
    logs: tuple[Path, ...]
    broke: dict[str, tuple[tuple[str, ...], str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialGroups:
    """All groups, the largest first.

    Attributes:
        left_out: logs that count for nothing, with the reason, in one line each.
        not_replayed: candidates that could be replayed over no log, with the reason.
    """

    groups: tuple[TrialGroup, ...]
    left_out: tuple[str, ...]
    not_replayed: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def logs(self) -> tuple[Path, ...]:
        """The logs of all trials that count."""
        return tuple(log for group in self.groups for log in group.logs)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Counted:
    """A log that may count as a trial, with its replays; lacking: candidates that have no bounds here, and why."""

    started_ns: int
    path: Path
    place: str
    limit: float
    records: tuple[StoredReplay, ...]
    lacking: dict[str, str]


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
    nothing, since nobody drove them. Where a candidate follows the beliefs of several estimators over logs of one
    kind, trials of one estimator are a group of their own. A candidate that broke on a trial of a group
    is out of the choice there, so that the others are judged among themselves; a log on which all broke is no trial.
    """
    kept, several = runs_once(replays)
    left_out = [s.words if s.kept else f"{s.words}; join them (lios log merge)" for s in several]
    unread, not_replayed, failed = _failures(replays, strategies)
    by_log: dict[str, list[StoredReplay]] = {}
    for record in kept:
        by_log.setdefault(record.sha256, []).append(record)
    found: dict[tuple[str, ...], list[_Counted]] = {}
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
        lacking = _lacking(records, strategies, failed.get(records[0].log, {}))
        if len(lacking) == len(strategies):
            left_out.append(f"{path.name}: no candidate ran over it. " + _reasons(lacking))
            continue
        driven = "in simulation" if run.info.source == "simulation" else f"by {run.info.source}"
        shared = (run.info.scenario, driven, *_more(by, run.info.place, run.info.title))
        one = _Counted(
            started_ns=run.info.started.ns,
            path=path,
            place=run.info.place,
            limit=run.task.failure_cost,
            records=tuple(records),
            lacking=lacking,
        )
        found.setdefault(shared, []).append(one)
    made: list[TrialGroup] = []
    for key, alike in found.items():
        for beliefs, rows in _by_beliefs(alike).items():
            words = f"beliefs of {beliefs}" if beliefs else ""
            rows.sort(key=lambda row: (row.started_ns, str(row.path)))
            made.append(_group(", ".join(part for part in (*key, words) if part), beliefs, rows, strategies))
    groups: list[TrialGroup] = []
    for group in made:
        if group.trials:
            groups.append(group)
        else:
            why = _reasons({name: why for name, (_, why) in group.broke.items()})
            left_out.append(f"{group.name}: no candidate ran over each of the {len(group.logs)} logs. {why}")
    return TrialGroups(
        groups=tuple(sorted(groups, key=lambda g: (-len(g.trials), g.name))),
        left_out=(*left_out, *unread),
        not_replayed=not_replayed,
    )


def _failures(
    replays: Replays, strategies: Sequence[str]
) -> tuple[tuple[str, ...], Mapping[str, str], Mapping[str, Mapping[str, str]]]:
    """What could not be replayed: logs in one line each, candidates that were replayed over no log with the reason,
    and per log that was replayed by others what failed there."""
    replayed = {r.log for r in replays}
    unread: dict[str, None] = {}
    of_log: dict[str, dict[str, str]] = {}
    for f in replays.failed:
        if f.log in replayed:
            of_log.setdefault(f.log, {})[f.strategy] = f.reason.removeprefix(f"{f.log}: ")
        else:
            unread[f.reason if f.reason.startswith(f.log) else f"{f.log}: {f.reason}"] = None
    names = dict.fromkeys(name for failed in of_log.values() for name in failed if name not in strategies)
    nowhere = [name for name in names if all(name in of_log.get(log, {}) for log in replayed)]
    reasons = {name: next(failed[name] for failed in of_log.values() if name in failed) for name in nowhere}
    return tuple(unread), MappingProxyType(reasons), MappingProxyType(of_log)


def _lacking(records: Sequence[StoredReplay], strategies: Sequence[str], failed: Mapping[str, str]) -> dict[str, str]:
    """The candidates without bounds on a log, with the reasons."""
    found = {r.strategy: r for r in records}
    lacking: dict[str, str] = {}
    for name in strategies:
        record = found.get(name)
        if record is None:
            # A planner that failed before it gave its name is known by the name that the user gave.
            others = [why for given, why in failed.items() if given not in strategies]
            lacking[name] = failed.get(name) or next(iter(others), "it was not replayed over this log")
        elif record.bounds is None:
            lacking[name] = record.reason
    return lacking


def _reasons(lacking: Mapping[str, str]) -> str:
    """The distinct reasons, each with the candidates that it is of."""
    of: dict[str, list[str]] = {}
    for name, why in lacking.items():
        of.setdefault(why, []).append(name)
    return "; ".join(f"{first_few(names, MAX_NAMED)}: {why}" for why, names in of.items())


def _more(by: GroupBy, place: str, title: str) -> tuple[str, ...]:
    if by is GroupBy.SCENARIO:
        return ()
    return (f"in {place}",) if by is GroupBy.SITE else (f"in {place}", title)


def _by_beliefs(rows: Sequence[_Counted]) -> Mapping[str, list[_Counted]]:
    """Logs of one kind by whose beliefs the candidates follow over each; all under "" where none follows several."""
    of: dict[str, list[StoredReplay]] = {}
    for record in (record for row in rows for record in row.records):
        of.setdefault(record.strategy, []).append(record)
    if all(len(estimators_in(replays)) < 2 for replays in of.values()):
        return {"": list(rows)}
    labels = estimator_labels(e for replays in of.values() for e in estimators_in(replays))
    found: dict[str, list[_Counted]] = {}
    for row in rows:
        found.setdefault(" and ".join(labels[e] for e in estimators_in(row.records)), []).append(row)
    return found


def _group(name: str, beliefs: str, rows: Sequence[_Counted], strategies: Sequence[str]) -> TrialGroup:
    broke: dict[str, tuple[tuple[str, ...], str]] = {}
    for row in rows:
        for candidate, reason in row.lacking.items():
            logs, why = broke.get(candidate, ((), reason))
            broke[candidate] = ((*logs, row.path.name), why)
    judged = [s for s in strategies if s not in broke]
    return TrialGroup(
        name=name,
        beliefs=beliefs,
        places=tuple(dict.fromkeys(row.place for row in rows)),
        trials=tuple(trial_costs(row.records, judged, limit=row.limit) for row in rows) if judged else (),
        logs=tuple(row.path for row in rows),
        broke=broke,
    )
