"""Gaps in a run: damaged places, missing action indexes and decision numbers, lost observations.

A run numbers its actions and decisions from 1 without a gap, observes each container that it searches, and believes
at its first decision about every container that it did not know at the start; its recorder numbers the messages of
each topic. Whatever breaks one of these was lost:
by damage, by a filter, or because the log is one part of several.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from replayers.log_tools.multi_run import NoRunInLog
from replayers.log_tools.recovered import EVIDENCE_TOPICS, Lost
from replayers.mcap_io.scan import Damage
from replayers.runs.run import Run, read
from workbench.errors import LiosError
from workbench.log_schema.events import (
    TOPIC_OF,
    ActionFinished,
    BeliefUpdate,
    ItemSighting,
    Observation,
    PlanComputed,
)
from workbench.message_enum import MessageEnum, Result
from workbench.tolerances import NEAR_LOGGED_SUM
from workbench.worlds.house import LocationId

if TYPE_CHECKING:
    from replayers.log_tools.info import Description

SIMULATED_SOURCES = ("simulation", "replay")


class StartKnowledge(MessageEnum):
    """Whether the log shows what the robot knew at the start, and if not, what is missing."""

    KNOWN = ""
    NO_FIRST_BELIEFS = "the beliefs of the first decision are missing, and with them what was known at the start"
    CONTAINERS_MISSING = "what was known at the start of {containers} is missing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Gaps:
    """What is missing from a run.

    Attributes:
        lost: one line for each kind of loss; empty where nothing is missing but perhaps the end of a log that was
            cut off.
        torn: the end of a log that was cut off inside a record, whose content had to be dropped; empty for none. All
            that the log holds stands nevertheless.
        actions_after_ns: actions may be missing after this time, in nanoseconds since the epoch; None where none is.
        not_looked: containers whose first observation is lost.
        beliefs: whether beliefs of some decisions are missing.
        start: whether the log shows what the robot knew at the start.
    """

    lost: tuple[str, ...] = ()
    torn: tuple[str, ...] = field(default=(), compare=False)
    actions_after_ns: int | None = None
    not_looked: frozenset[str] = frozenset()
    beliefs: bool = False
    start: Result[StartKnowledge] = field(default_factory=StartKnowledge.KNOWN.result)

    @property
    def dropped(self) -> tuple[str, ...]:
        """One line for all that is missing, the torn end too: where there is any, commands exit with 3."""
        return (*self.lost, *self.torn)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogLosses:
    """What several logs lack.

    Attributes:
        lost: by log, one line for each kind of loss; logs of which nothing was dropped are left out.
        cut_off: logs that end early.
    """

    lost: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    cut_off: tuple[str, ...] = ()

    @property
    def lines(self) -> list[str]:
        """One line for each log that is not whole."""
        ends = [
            f"note: {log} is cut off: its end is missing, and nothing else"
            for log in self.cut_off
            if log not in self.lost
        ]
        return [*(f"note: {log} is not whole: {'; '.join(what)}" for log, what in self.lost.items()), *ends]


def gaps_of(run: Run) -> Gaps:
    """What is missing from a run; a log that merely ends early has no gaps."""
    damages = [damage for damage in run.damage if damage.loses_content and not damage.cut_off]
    closed = run.closed and run.outcome is None and bool(run.plans) and not _only_end_lost(run)
    lost: list[str] = []
    if damages:
        lost.append(damage_line(damages))
    if run.recovered is not None and run.recovered.lost is Lost.MIDDLE:
        lost.append(run.recovered.words or run.recovered.lost)
    indexes = {action.index for action in run.actions}
    absent = sorted(set(range(1, max(indexes, default=0))) - indexes)
    if absent:
        lost.append(f"{_many(len(absent), 'action')} of {max(indexes)} missing, the first number {absent[0]}")
    after_ns = _first_gap_ns(run.actions, absent)
    if after_ns is None and (closed or (damages and run.outcome is None) or _ended_later(run)):
        after_ns = max((action.stamp.ns for action in run.actions), default=0)
        lost.append("actions at its end are missing")
    made = {plan.decision for plan in run.plans}
    undecided = sorted(set(range(1, max(made, default=0))) - made)
    if undecided:
        lost.append(f"{_many(len(undecided), 'decision')} of {max(made)} missing, the first number {undecided[0]}")
    messages = {topic: run.skipped[topic] for topic in sorted(run.skipped) if topic in EVIDENCE_TOPICS}
    if messages:
        lost.append(
            ", ".join(f"{count} of {topic}" for topic, count in messages.items()) + " missing by their numbers"
        )
    not_looked = _first_looks_lost(run, certain=not lost)
    if not_looked:
        lost.append(f"what was seen in {', '.join(sorted(not_looked)[:3])} is missing")
    start = _start_knowledge(run, certain=not lost)
    if start.kind is not StartKnowledge.KNOWN:
        lost.append(start.message)
    return Gaps(
        lost=tuple(lost),
        torn=_torn_end(run),
        actions_after_ns=after_ns,
        not_looked=not_looked,
        beliefs=bool(lost and made - {belief.decision for belief in run.beliefs}) or bool(undecided),
        start=start,
    )


def damage_line(damages: Sequence[Damage]) -> str:
    """What is missing by damage, of which there is some."""
    return f"{_many(len(damages), 'place')} of the log could not be read, the first at byte {damages[0].offset}"


def torn_line(offset: int) -> str:
    """What is missing from a log that ends inside a record."""
    return f"it was cut off inside a record: what came {Lost.END}, at byte {offset}, is lost"


def losses(runs: Iterable[Run]) -> LogLosses:
    """What runs lack."""
    lost: dict[str, tuple[str, ...]] = {}
    cut_off: list[str] = []
    for run in runs:
        dropped = gaps_of(run).dropped
        if dropped:
            lost[str(run.path)] = dropped
        if run.is_cut_off:
            cut_off.append(str(run.path))
    return LogLosses(lost=lost, cut_off=tuple(cut_off))


def losses_of_logs(paths: Iterable[Path]) -> LogLosses:
    """What logs lack to be runs; of a log that holds several, or that cannot be read, nothing is said."""
    from replayers.log_tools.info import describe

    lost: dict[str, tuple[str, ...]] = {}
    cut_off: list[str] = []
    for path in paths:
        try:
            found = losses([read(path)])
        except NoRunInLog as error:
            about = describe(path)
            if about.info is None:
                continue  # using the log says why
            cut = [damage for damage in about.loss.damages if damage.cut_off]
            found = LogLosses(
                lost={str(path): _lines_of_no_run(error, about.loss.damages)}, cut_off=(str(path),) if cut else ()
            )
        except LiosError:
            continue  # using the log says why
        lost |= found.lost
        cut_off += found.cut_off
    return LogLosses(lost=lost, cut_off=tuple(cut_off))


def losses_of_listed(found: Description) -> tuple[str, ...]:
    """What had to be dropped of a described log, or is missing from its run, by all its checksums too."""
    from replayers.mcap_io.integrity import damages_behind

    damages = damages_behind(found.path, found.index) if found.indexed else found.loss.damages
    damages = [damage for damage in damages if damage.loses_content]
    try:
        return gaps_of(replace(read(found.path), damage=tuple(damages))).dropped
    except NoRunInLog as error:
        return _lines_of_no_run(error, damages) if found.info is not None else _damage_lines(damages)
    except LiosError:
        return _damage_lines(damages)


def _lines_of_no_run(error: NoRunInLog, damages: Sequence[Damage]) -> tuple[str, ...]:
    """What is missing from a log that names its run, and lacks something without which nothing can be replayed."""
    return (*_damage_lines(damages), f"{error.lacks} is missing: it cannot be replayed")


def _damage_lines(damages: Iterable[Damage]) -> tuple[str, ...]:
    found = [damage for damage in damages if damage.loses_content]
    places = [damage for damage in found if not damage.cut_off]
    cut = (torn_line(damage.offset) for damage in found if damage.cut_off)
    return (*((damage_line(places),) if places else ()), *cut)


def _torn_end(run: Run) -> tuple[str, ...]:
    """What was lost in the record in which a log, or the log that it was recovered from, was cut off."""
    torn = next((damage for damage in run.damage if damage.cut_off and damage.loses_content), None)
    if torn is not None:
        return (torn_line(torn.offset),)
    words = run.recovered.words if run.recovered is not None and run.recovered.torn else None
    return (words,) if words else ()


def _only_end_lost(run: Run) -> bool:
    """Whether it is a copy of a log that was cut off, with every message that rests in that log."""
    if run.recovered is None:
        return False
    events = {
        ActionFinished: run.actions,
        BeliefUpdate: run.beliefs,
        ItemSighting: run.sightings,
        Observation: run.observations,
        PlanComputed: run.plans,
    }
    return run.recovered.only_end_lost({TOPIC_OF[kind]: len(found) for kind, found in events.items()})


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"


def _first_gap_ns(actions: Iterable[ActionFinished], absent: list[int]) -> int | None:
    """When the last action before the first missing one ended; 0 if the first action is missing."""
    if not absent:
        return None
    return max((action.stamp.ns for action in actions if action.index < absent[0]), default=0)


def _ended_later(run: Run) -> bool:
    """Whether the outcome has more searches, or a higher cost, than the actions."""
    if run.outcome is None:
        return False
    searches = sum(action.action == "search" and action.success for action in run.actions)
    if run.outcome.searches > max(searches, sum(action.action == "search" for action in run.actions)):
        return True
    simulated = run.info.source in SIMULATED_SOURCES
    return simulated and run.outcome.own_cost - sum(action.cost for action in run.actions) > NEAR_LOGGED_SUM


def _first_looks_lost(run: Run, *, certain: bool) -> frozenset[str]:
    """Containers that were searched, or picked from, before their first observation in the log.

    Args:
        certain: nothing else is missing: where the run is not simulated, a pick without a look is then one in a
            container of which no look counts.
    """
    without_look = certain and run.info.source not in SIMULATED_SOURCES
    first_seen: dict[str, int] = {}
    for seen in run.observations:
        first_seen[seen.container] = min(seen.stamp.ns, first_seen.get(seen.container, seen.stamp.ns))
    containers = {container.id for container in run.place.plan.containers}
    return frozenset(
        action.target
        for action in run.actions
        if action.success
        and action.target in containers
        and (
            (action.action == "search" and not _observed_by(action.stamp.ns, first_seen.get(action.target)))
            or (
                action.action == "pick"
                and not without_look
                and not _observed_by(action.start.ns, first_seen.get(action.target))
                and not _sighted_before(run, action)
            )
        )
        and not (action.action == "search" and _ends_the_log(run, action))
    )


def _observed_by(stamp_ns: int, seen_ns: int | None) -> bool:
    return seen_ns is not None and seen_ns <= stamp_ns


def _sighted_before(run: Run, pick: ActionFinished) -> bool:
    """Whether what was picked had been seen there in passing, so that no look was needed."""
    return any(
        s.container == pick.target and s.item.id in pick.items and s.stamp <= pick.start for s in run.sightings
    )


def _ends_the_log(run: Run, action: ActionFinished) -> bool:
    """Whether it is the last thing in a log that was cut off, so that its observation was not flushed."""
    return run.outcome is None and action.index == max(a.index for a in run.actions)


def _start_knowledge(run: Run, *, certain: bool) -> Result[StartKnowledge]:
    """Whether the log shows what the robot knew at the start."""
    known = StartKnowledge.KNOWN.result()
    first = min(run.beliefs, key=lambda belief: belief.decision, default=None)
    if certain:
        return known
    if first is None and not run.plans and not run.actions and any(o.known_at_start for o in run.observations):
        return known  # broken off before the first decision
    if first is None or first.decision != 1:
        return StartKnowledge.NO_FIRST_BELIEFS.result()
    seen = {o.container for o in run.observations if o.known_at_start or o.stamp.ns <= first.stamp.ns}
    reached = {c.id for c in run.place.plan.containers if run.place.travel.reaches(LocationId(c.id))}
    absent = sorted(reached - seen - set(first.containers))
    if not absent or not (run.observations or run.actions) or not first.containers:
        return known
    return StartKnowledge.CONTAINERS_MISSING.result(containers=", ".join(absent[:3]))
