"""The estimator of a replay: the log's own first belief, the estimator that the log names, or one that a user names.

A counterfactual asks what another planner would have done with the same belief. Where the log's beliefs never
changed about a pair (the estimators that go by names alone), its first one is all there is to know; otherwise, and
where an old log rounded them, the estimator that the log names is asked again.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from replayers.counterfactual.evidence import Evidence
from workbench.beliefs.asking.answered_estimator import AnsweredEstimator, answered, uses_names_alone
from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.guarded_estimator import GuardedEstimator
from workbench.beliefs.memory.memory_estimator import with_memory, without_memory
from workbench.caches import Cache
from workbench.errors import BadValue, LiosError, Unsupported
from workbench.execution.events import Event, RunEnded, RunStatus
from workbench.log_schema.events import BeliefUpdate
from workbench.plugins import NameOrigin, quoted
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

NAMES_ALONE = ("counts", "fcnn", "people")
"""Estimators that no observation of a run changes."""

LEARNING = ("best", "mixed")
"""Estimators that every observation changes, even where a short run does not show it."""

MAX_CACHED_BELIEFS = 10_000
"""Entries in the cache; beyond this, it is cleared."""

ROUNDED = (
    "the log rounds beliefs to six decimals, and the estimator that made them is not asked: a decision that goes by "
    "them may have been another one, so lower and upper hold whatever is believed; 'if beliefs stand' and the "
    "estimate take the rounded beliefs as they are"
)
"""Half a millionth can flip a decision: then nothing that goes by beliefs is certain."""

HELD = "the log's first belief is held fixed: the estimator that made it, with these weights, is not here"


class BeliefMissing(Unsupported):
    """The estimator of a replay gave no belief; the message is its own."""


class NoBelief(Unsupported):
    """A replay needs beliefs that neither the log nor an estimator can supply."""

    def __init__(self, log: str, estimator: str, reason: str) -> None:
        super().__init__(
            f"{log}: its beliefs do not cover this task and its estimator {quoted(estimator)} is not available here "
            f"({reason}). Name another with --estimator."
        )


@final
class RecordedBeliefs:
    """The log's beliefs one after the other, for verification, which takes the very same steps."""

    def __init__(self, evidence: Evidence, beliefs: Sequence[BeliefUpdate]) -> None:
        self._otherwise = LoggedBelief(evidence)
        self._left = list(beliefs)
        self._last: tuple[Knowledge, tuple[ItemType, ...], Belief] | None = None

    @property
    def name(self) -> str:
        return self._otherwise.name

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The next one if it is about the same containers and types; the first one otherwise. A repeated request for
        the same knowledge, as by a warm-up, gets the same belief."""
        if self._last is not None and self._last[0] is knowledge and self._last[1] == item_types:
            return self._last[2]
        made = self._next(knowledge, item_types)
        self._last = (knowledge, item_types, made)
        return made

    def _next(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        if self._left:
            update = self._left.pop(0)
            if update.containers == knowledge.unsearched and update.item_types == item_types:
                return Belief(
                    item_types=item_types,
                    containers=knowledge.unsearched,
                    probability=np.array(update.probability).reshape(len(item_types), len(knowledge.unsearched)),
                    estimator=self.name,
                )
        return self._otherwise.believe(knowledge, item_types)


@final
class LoggedBelief:
    """Answers with the first probability in the log; 0 for a pair that the log does not name."""

    def __init__(self, evidence: Evidence) -> None:
        self.evidence = evidence
        self._made: Cache[tuple[tuple[ContainerId, ...], tuple[ItemType, ...]], Belief] = Cache(MAX_CACHED_BELIEFS)

    @property
    def name(self) -> str:
        return self.evidence.info.estimator or "logged"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        containers = knowledge.unsearched
        return self._made.get((containers, item_types), lambda: self._about(containers, item_types))

    def _about(self, containers: tuple[ContainerId, ...], item_types: tuple[ItemType, ...]) -> Belief:
        first = self.evidence.first_belief
        rows = [[first.get((t, c), 0.0) for c in containers] for t in item_types]
        probability = np.array(rows, dtype=np.float64).reshape(len(item_types), len(containers))
        return Belief(item_types=item_types, containers=containers, probability=probability, estimator=self.name)


def covers(evidence: Evidence, item_types: Iterable[ItemType]) -> bool:
    """Whether the log's first beliefs name, for these types, every container that a run may search."""
    places = [c for c in (*evidence.contents, *evidence.open, *evidence.refused_searches) if c not in evidence.known]
    reachable = [c for c in places if evidence.place.travel.reaches(LocationId(c))]
    return all((t, c) in evidence.first_belief for t in item_types for c in reachable)


@final
class RememberedBeliefs:
    """An estimator that uses names alone, asked once for each set of containers that are left.

    Which those are, and which types are asked for, is all that its beliefs depend on over one log.
    """

    def __init__(self, estimator: Estimator) -> None:
        self.name = estimator.name
        self._estimator = estimator
        self._made: Cache[Hashable, Belief] = Cache(MAX_CACHED_BELIEFS)

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        key = knowledge.unsearched, item_types
        return self._made.get(key, lambda: self._estimator.believe(knowledge, item_types))


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimatorChoice:
    """Who believes in a replay.

    Attributes:
        estimator: what is asked.
        static_beliefs: it uses names alone; otherwise all observations change it, and so would the other contents of
            an open container.
        rounded: it answers with beliefs that the log rounded; decisions by them may have been others.
        hypothetical: a user chose this estimator instead of the run's; with it the recorded strategy need not do what
            it did.
        note: where it is not who believed in the run.
    """

    estimator: Estimator
    static_beliefs: bool
    rounded: bool = False
    hypothetical: bool = False
    note: str = ""

    @property
    def asked_once(self) -> Estimator:
        """The estimator, asked once for the same where that can make no difference."""
        found = self.estimator
        from_elsewhere = isinstance(found, AnsweredEstimator | GuardedEstimator | LoggedBelief)
        return RememberedBeliefs(found) if self.static_beliefs and not from_elsewhere else found


def with_beliefs(events: Iterator[Event]) -> Iterator[Event]:
    """The events of a run over a log, all of whose decisions had a belief.

    Raises:
        BeliefMissing: the estimator failed; then a replay says nothing.
    """
    for event in events:
        if isinstance(event, RunEnded) and event.status is RunStatus.ESTIMATOR_FAILED:
            raise BeliefMissing(event.reason)
        yield event


LEARNS = (
    "beliefs follow all that is seen, so that what else lies in an unopened container moves them: where that may "
    "change a decision, bounds are outer ones; 'if beliefs stand' and the estimate take it as if nothing but the "
    "task's types were there, and --estimator first holds the log's first belief fixed instead"
)


def estimator_for(
    evidence: Evidence,
    item_types: tuple[ItemType, ...],
    *,
    name: str = "log",
    origin: NameOrigin = NameOrigin.LOG,
    other_memory: bool = False,
    may_ask: bool = False,
    limit_s: float | None = None,
) -> EstimatorChoice:
    """The estimator whose beliefs a replay uses.

    Args:
        name: "log" takes the log's first belief where it never changed and was not rounded, and the estimator that
            the log names otherwise, or the answers that it was given; "first" holds the log's first belief fixed;
            another name is an estimator.
        origin: who gives another name. The estimator that the log names is the log's in any case.
        other_memory: the evidence's memory is not what the robot remembered; the log's beliefs do not know it.
        may_ask: whether an estimator of another name, whose answers cost something, is asked for those that neither
            the log nor the cache holds.
        limit_s: the longest that an estimator from outside may take for a belief.

    Raises:
        NoBelief: nothing suffices.
        UnknownName, NotFromLog: no such estimator, or one that only a user may name.
    """
    whole, recorded = covers(evidence, item_types), evidence.info.estimator
    if name == "first":
        if not whole or other_memory:
            why = "leaves containers out" if not whole else "does not know what --memory remembers"
            raise NoBelief(evidence.path, recorded, f"the log's first belief {why}")
        return _first_of(evidence, hypothetical=not evidence.static_beliefs)
    if name != "log":
        found = estimator_of(evidence, name, origin, may_ask=may_ask, limit_s=limit_s)
        other = found.name != recorded
        note = f"beliefs by {found.name}; the run used {recorded}" if other else ""
        static = (name in NAMES_ALONE or uses_names_alone(found)) and evidence.memory is None
        return EstimatorChoice(estimator=found, static_beliefs=static, hypothetical=other, note=note)
    kind = recorded.partition("@")[0]
    follows = evidence.asking is not None and not evidence.asking.names_alone
    stays = evidence.static_beliefs and whole and kind not in LEARNING and evidence.memory is None and not follows
    if stays and not evidence.rounded:
        return _first_of(evidence)
    found = by_answers(evidence)
    if found is not None:
        return EstimatorChoice(estimator=found, static_beliefs=not follows, note=LEARNS if follows else "")
    held = whole and not other_memory
    try:
        found = estimator_of(evidence, kind, NameOrigin.LOG, limit_s=limit_s)
    except LiosError as error:
        if held:
            return _first_of(evidence, note="" if stays else HELD)
        raise NoBelief(evidence.path, recorded, str(error)) from error
    same = without_memory(found.name) == without_memory(recorded)
    if not same and held:
        return _first_of(evidence, note="" if stays else HELD)
    static = (kind in NAMES_ALONE or uses_names_alone(found)) and evidence.memory is None
    other = "" if same else f"beliefs by {found.name}; the run used {recorded}. "
    note = (other + ("" if static else LEARNS)).rstrip(". ")
    return EstimatorChoice(estimator=found, static_beliefs=static, note=note)


def estimator_of(
    evidence: Evidence, name: str, origin: NameOrigin, *, may_ask: bool = False, limit_s: float | None = None
) -> Estimator:
    """An estimator by name, with the answers that the log holds and the memory that the robot of the log had.

    Args:
        may_ask, limit_s: as in estimator_for.

    Raises:
        UnknownName, NotFromLog, PluginNotLoaded: as `estimator`.
        BadValue: an estimator that asks, with a memory.
    """
    from workbench.beliefs.estimators import estimator

    found = estimator(name, origin=origin, known=evidence.answers, may_ask=may_ask, limit_s=limit_s)
    return with_memory(found, evidence.memory)


def by_answers(evidence: Evidence) -> Estimator | None:
    """The run's estimator as far as the log's answers go, which asks nobody; None where it takes code of its own."""
    if evidence.asking is None or evidence.asking.name != evidence.info.estimator:
        return None
    asking = evidence.asking.asking()
    return None if asking is None else answered(asking, evidence.answers, may_ask=False)


def may_ask_estimator(name: str, *, ask: bool) -> bool:
    """Whether an estimator may be asked for new answers: only one that a user names, since logs are strangers'.

    Raises:
        BadValue: nobody is named.
    """
    if ask and name in ("log", "first"):
        raise BadValue("--ask", True, "given together with --estimator, which names whom to ask")
    return ask


def _first_of(evidence: Evidence, *, hypothetical: bool = False, note: str = "") -> EstimatorChoice:
    """The log's first belief, held fixed, with a note where the log rounded it."""
    words = ". ".join(w for w in (note, ROUNDED if evidence.rounded else "") if w)
    return EstimatorChoice(
        estimator=LoggedBelief(evidence),
        static_beliefs=True,
        rounded=evidence.rounded,
        hypothetical=hypothetical,
        note=words,
    )
