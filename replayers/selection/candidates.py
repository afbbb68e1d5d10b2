"""Candidates that differ in whose beliefs they follow: every strategy with every estimator, over the same worlds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from replayers.batch.replay_all import LogFailed, Outcome
from replayers.batch.replays import BY_THE_LOG, Log, Progress, Replays
from replayers.batch.replays import replay as replay_logs
from replayers.batch.store import StoredReplay
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.runs.run import read
from replayers.selection.prior_costs import with_priors
from workbench.beliefs.estimators import estimator
from workbench.beliefs.memory.memory_estimator import without_memory
from workbench.errors import BadValue
from workbench.files import file_name_of
from workbench.plugins import NameOrigin

DRAWN_BY = "counts"
"""By whose beliefs worlds are drawn where candidates differ in theirs: by its own, each would seem to do well."""


def estimators_named(text: str) -> tuple[str, ...]:
    """The estimators of a list with commas.

    Raises:
        BadValue: none; or several, one of which is another one in each log.
    """
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise BadValue("--estimator", text, "names with commas between them")
    if len(names) > 1 and set(names) & set(BY_THE_LOG):
        raise BadValue("--estimator", text, "estimators that are the same over all logs, or log or first alone")
    return names


def replay_candidates(
    logs: Log | Sequence[Log],
    strategies: str,
    estimators: Sequence[str],
    *,
    settings: ReplaySettings,
    output: Path | None = None,
    workers: int | None = 1,
    progress: Progress | None = None,
) -> Replays:
    """Replays every strategy with every estimator, with prior costs; with several, each is called STRATEGY by
    ESTIMATOR.

    Args:
        output: the folder that keeps the replays, in one of its own for each of several estimators.

    Raises:
        UnknownName, PluginNotLoaded, FileMissing, MalformedFile: an estimator that there is not, and as `replay`.
    """
    if len(estimators) == 1:
        by = replace(settings, estimator=estimators[0])
        replays = replay_logs(logs, strategies, settings=by, output=output, workers=workers, progress=progress)
        made = with_priors(replays, strategies, output=output, workers=workers or 1)
        return made if estimators[0] in BY_THE_LOG else _driven_by_another(made)
    named = named_estimators(estimators)
    of_each: list[Replays] = []
    for one in named:
        by = replace(settings, estimator=one.given, drawn_by=DRAWN_BY)
        folder = None if output is None else output / file_name_of(one.label)
        replays = replay_logs(logs, strategies, settings=by, output=folder, workers=workers, progress=progress)
        of_each.append(with_priors(replays, strategies, output=folder, workers=workers or 1))
    return _together(of_each, named)


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedEstimator:
    """One of several estimators.

    Attributes:
        given: the name by which a user gives it.
        name: its own, with the hash.
        label: what it is called in tables: without the hash, where no other one is called so.
    """

    given: str
    name: str
    label: str


def named_estimators(estimators: Iterable[str]) -> tuple[NamedEstimator, ...]:
    """The estimators of these names, in order."""
    names = {given: estimator(given, origin=NameOrigin.USER, may_ask=False).name for given in estimators}
    short = Counter(name.partition("@")[0] for name in names.values())
    full = Counter(names.values())
    return tuple(
        NamedEstimator(given=given, name=name, label=_label(given, name, short, full))
        for given, name in names.items()
    )


def _label(given: str, name: str, short: Counter[str], full: Counter[str]) -> str:
    plain = name.partition("@")[0]
    if short[plain] == 1:
        return plain
    return name if full[name] == 1 else given


def _together(made: Sequence[Replays], estimators: Sequence[NamedEstimator]) -> Replays:
    """The replays by all estimators as those of one call, log by log."""
    outcomes: dict[str, list[Outcome]] = {}
    for replays, estimator_name in zip(made, estimators, strict=True):
        for outcome in replays.outcomes:
            of_log = outcomes.setdefault(outcome.log, [])
            called = _called(outcome, estimator_name)
            if isinstance(called, StoredReplay) or called not in of_log:
                of_log.append(called)
    return replace(made[0], outcomes=tuple(o for of_log in outcomes.values() for o in of_log))


def _called(outcome: Outcome, estimator_name: NamedEstimator) -> Outcome:
    """An outcome under its candidate's name. The robot followed it if it followed this strategy by this estimator."""
    if isinstance(outcome, LogFailed):
        return replace(outcome, strategy=f"{outcome.strategy} by {estimator_name.label}" if outcome.strategy else "")
    believed = _recorded_estimator(outcome)
    drove = estimator_name.label if believed == estimator_name.name else believed
    return msgspec.structs.replace(
        outcome,
        strategy=f"{outcome.strategy} by {estimator_name.label}",
        recorded_strategy=f"{outcome.recorded_strategy} by {drove}",
    )


def _driven_by_another(replays: Replays) -> Replays:
    """Replays by one estimator: a robot that followed the beliefs of another one drove none of the candidates."""
    outcomes = tuple(
        msgspec.structs.replace(o, recorded_strategy=f"{o.recorded_strategy} by {recorded}")
        if isinstance(o, StoredReplay) and (recorded := _recorded_estimator(o)) != o.estimator
        else o
        for o in replays.outcomes
    )
    return replace(replays, outcomes=outcomes)


def _recorded_estimator(record: StoredReplay) -> str:
    """Whose beliefs the robot followed; its memory is of the trial, and not another estimator."""
    return without_memory(read(record.log).info.estimator)
