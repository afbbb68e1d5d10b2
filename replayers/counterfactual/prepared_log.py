"""A log prepared for replay: its evidence, its beliefs and its sampled worlds, computed once for all strategies.

Sharing them among all strategies makes comparisons paired: every strategy meets the same worlds.
"""

from __future__ import annotations

import hashlib
from collections.abc import Generator, Hashable
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf
from typing import final

from replayers.counterfactual.bounds.bounds import DEFAULT_BUDGET, Budget
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.world_search import WorldSearch
from replayers.counterfactual.durations import SIMULATED, Durations, fitted_durations
from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds
from replayers.counterfactual.estimates.worlds_given import worlds_given
from replayers.counterfactual.evidence import Evidence, evidence_of, is_plain
from replayers.counterfactual.fast_strategy import fast_strategy
from replayers.counterfactual.logged_belief import EstimatorChoice, LoggedBelief, estimator_for
from replayers.counterfactual.logged_world import NoPaths
from replayers.counterfactual.overlooked import contradicting_types, misses_note
from replayers.counterfactual.relevance import Assumptions, Relevance, relevance_of
from replayers.counterfactual.reproduction import SIMULATED_SOURCES, Reproduction, reproduce
from replayers.counterfactual.run_tree import RunTree
from replayers.counterfactual.sandbox import foreign_planner, is_foreign, is_from_outside
from replayers.counterfactual.strategy_traits import eq1_parts, looks_by, search_traits, uses_beliefs
from replayers.counterfactual.tree.options import TreeOptions
from replayers.counterfactual.tree.plain_events import plain_events
from replayers.runs.contents import house_from_truth
from replayers.runs.run import Run
from workbench.beliefs.asking.answered_estimator import AnsweredEstimator
from workbench.beliefs.asking.answers import NotAnswered
from workbench.beliefs.belief import Estimator
from workbench.beliefs.memory.history import History, history_for
from workbench.beliefs.memory.move_rates import MoveRates, shipped_rates
from workbench.caches import Cache, PerObject
from workbench.errors import Unsupported
from workbench.execution.events import Event
from workbench.log_schema.events import Outcome
from workbench.log_schema.place import house_sha256
from workbench.planning.actions import relevant_types
from workbench.planning.composed import Composed
from workbench.planning.strategies import canonical_name, strategy
from workbench.planning.strategy import Strategy
from workbench.plugins import NameOrigin
from workbench.worlds.house import House, ItemType
from workbench.worlds.travel import Paths

MAX_SHARED_SEARCHES = 2
"""Finished searches of the worlds that are kept, each with its run tree."""


class TruthNotRecorded(Unsupported):
    """The recorded truth was requested, and the log does not hold it."""

    def __init__(self, path: object) -> None:
        super().__init__(f"{path}: this log holds no ground truth. Leave --with-truth out.")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaySettings:
    """How replays are made.

    Attributes:
        estimator: "log", "first", or an estimator's name (logged_belief.py).
        estimator_origin: who gives that name; no answer depends on it, so it is in no replay's key.
        worlds: how many worlds the estimate draws; 0 leaves it out.
        drawn_by: the built-in estimator by whose beliefs they are drawn, so that replays by several estimators meet
            the same worlds; empty for the replay's own.
        budget: how far the tree of runs is followed.
        assumptions: what is taken for granted beyond the log.
        with_truth: also run in the recorded truth.
        ask: an estimator whose answers cost something is asked for those that neither log nor cache holds.
        timeout_s: the longest that a planner from outside may take for one decision, and an estimator for a belief.
        in_process: planners from outside run in this process, without a time limit, so that a debugger stops in
            them; no answer depends on it, so it is in no replay's key.
        histories: earlier runs that the strategies remember, one history for each place of the logs, in place of what
            the robot remembered; empty for the robot's own memory.
        rates: how often things move, for these histories.
        seed: of the drawn worlds. The strategies' own seed is the run's.
    """

    estimator: str = "log"
    estimator_origin: NameOrigin = field(default=NameOrigin.LOG, repr=False)
    worlds: int = 200
    budget: Budget = DEFAULT_BUDGET
    assumptions: Assumptions = field(default_factory=Assumptions)
    with_truth: bool = False
    ask: bool = field(default=False, repr=False)
    timeout_s: float = 10.0
    in_process: bool = field(default=False, repr=False)
    histories: tuple[History, ...] = ()
    rates: MoveRates | None = None
    seed: int = 0
    drawn_by: str = ""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenTree:
    """The tree of the strategy that drove a run, from its reproduction, with whose beliefs it was made."""

    planner: Strategy
    estimator: Estimator
    tree: RunTree

    def is_of(self, prepared: PreparedLog, planner: Strategy) -> bool:
        """Whether it is what a strategy would do over a log."""
        same = self.tree.evidence is prepared.evidence and self.estimator is prepared.estimator
        return same and self.planner == planner


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedLog:
    """One log prepared for any number of strategies.

    Attributes:
        evidence: what the log makes certain.
        estimator, static_beliefs: who believes, and whether it uses names alone (logged_belief.py).
        worlds: drawn once for all strategies, so that comparisons are paired.
        truth: the recorded truth, where it may be used.
        recorded: the end of the recorded run; None where the log is cut off before it.
        exact_beliefs: the estimator answers what the robot believed, not what a log made of it by rounding.
        contradicting: types that the inventory lists and no look found, though nothing was left to open: of each, a
            recorded look overlooked one (evidence.misses).
        reproduction: whether the recorded strategy does with these beliefs what was recorded.
        claims: whether a replay says anything: not where the recorded strategy does something else, unless other
            beliefs than the run's were asked for.
        place_sha256: the plan and its travel costs, hashed, whatever the place where the run started.
        draws: names the drawn worlds; only replays with the same draws are paired.
        search_cache: the searches that strategies over this log have requested.
        searched: finished searches of the worlds, by what the strategies that share them have in common.
        driven: by its name, the tree of the run's own strategy, until a replay of that strategy takes it over.
        paths: the paths between locations, each found once.
        with_paths: whether runs over the log hold the paths walked and explain their decisions.
    """

    evidence: Evidence
    estimator: Estimator
    static_beliefs: bool
    worlds: SampledWorlds | None
    durations: Durations
    truth: House | None
    settings: ReplaySettings
    recorded: Outcome | None
    place_sha256: str
    draws: str
    paths: Paths
    with_paths: bool = True
    exact_beliefs: bool = True
    contradicting: tuple[ItemType, ...] = ()
    reproduction: Reproduction = field(default_factory=lambda: Reproduction(same=None))
    claims: bool = True
    notes: tuple[str, ...] = ()
    search_cache: SearchCache = field(default_factory=SearchCache, compare=False)
    searched: Cache[Hashable, WorldSearch] = field(
        default_factory=lambda: Cache(MAX_SHARED_SEARCHES), compare=False, repr=False
    )
    driven: Cache[str, DrivenTree] = field(default_factory=lambda: Cache(2), compare=False, repr=False)

    @property
    def is_fitted(self) -> bool:
        """Whether the durations were fitted to the log, as they are for a robot's."""
        return bool(self.durations.samples)

    @property
    def is_plain(self) -> bool:
        """Whether the first segment of a tree tells all events of the run over the log alone (plain_events.py): of an
        estimator that asks, its answers are events too."""
        return is_plain(self.evidence) and not isinstance(self.estimator, AnsweredEstimator)

    @contextmanager
    def planner(self, name: str, *, origin: NameOrigin) -> Generator[Strategy]:
        """The strategy of a name; one from outside runs in a process of its own, or as the settings say, while this
        lasts.

        Raises:
            UnknownName, NotFromLog: as workbench.planning.strategies.strategy.
        """
        if not is_foreign(name, origin=origin):
            yield strategy(name, origin=origin)
            return
        limit_s, here = self.settings.timeout_s, self.settings.in_process
        with foreign_planner(name, origin=origin, timeout_s=limit_s, in_process=here) as planner:
            yield planner

    def estimator_of(self, planner: Strategy) -> Estimator:
        """Who believes for a strategy: one whose answers cost something is not asked for a strategy that goes by
        distance alone, which then gets the log's first belief."""
        asks = isinstance(self.estimator, AnsweredEstimator)
        if asks and not uses_beliefs(planner, self.evidence.task.goal):
            return LoggedBelief(self.evidence)
        return self.estimator

    def relevance_to(self, asked: tuple[ItemType, ...]) -> Relevance:
        """What matters over the log where beliefs are requested for these types."""
        made = partial(relevance_of, self.evidence, asked, self.settings.assumptions)
        return self.search_cache.relevances.get(asked, made)

    def exact_beliefs_of(self, planner: Strategy) -> bool:
        """Whether beliefs are the robot's own: they are not rounded, or the run's own strategy does what it did."""
        return self.exact_beliefs or self._drove(planner)

    def is_driven_again(self, planner: Strategy) -> bool:
        """Whether a replay is the recorded run and tags are seen in passing as they were; else, that is chance."""
        evidence = self.evidence
        return evidence.tags is not None and not evidence.misses and self._drove(planner)

    def _drove(self, planner: Strategy) -> bool:
        """Whether a strategy is the run's own and does what it recorded, to its end."""
        name = canonical_name(planner.name)
        return name is not None and name == canonical_name(self.evidence.info.strategy) and self.reproduction.whole


def prepare_log(run: Run, settings: ReplaySettings, *, with_paths: bool = True) -> PreparedLog:
    """Prepares a log.

    Args:
        with_paths: whether runs over the log include the paths walked, and what their decisions were weighed against;
            only recordings and drawings need them.

    Raises:
        NoBelief, UnknownName: no beliefs are available.
        TruthNotRecorded: the truth was requested and is not in the log.
        NoRunOfPlace, NoEarlierRun: no history given is of this place, or it is of later.
    """
    as_logged, other_memory = _with_history(evidence_of(run), settings)
    if settings.with_truth and run.truth is None:
        raise TruthNotRecorded(run.path)
    types = relevant_types(as_logged.task.goal)
    contradicting = contradicting_types(as_logged, relevance_of(as_logged, types, settings.assumptions))
    evidence = replace(as_logged, misses=max(settings.assumptions.misses or 0, len(contradicting)))
    choice = estimator_for(
        evidence,
        types,
        name=settings.estimator,
        origin=settings.estimator_origin,
        other_memory=other_memory,
        may_ask=settings.ask,
        limit_s=inf if settings.in_process else settings.timeout_s,
    )
    estimator = choice.asked_once
    hypothetical = choice.hypothetical or other_memory
    fitted = None if evidence.info.source in SIMULATED_SOURCES else fitted_durations(run.actions)
    prepared = PreparedLog(
        evidence=evidence,
        estimator=estimator,
        static_beliefs=choice.static_beliefs,
        worlds=None,
        durations=fitted or SIMULATED,
        truth=house_from_truth(run.place.plan, run.truth) if settings.with_truth and run.truth is not None else None,
        settings=settings,
        recorded=run.outcome,
        place_sha256=house_sha256(run.place),
        draws=_draws(evidence, settings, drawer_of(estimator, settings)),
        paths=evidence.place.paths() if with_paths else NoPaths(evidence),
        with_paths=with_paths,
        exact_beliefs=not choice.rounded,
        contradicting=contradicting,
    )
    by_tree = partial(_reproduced_by_tree, prepared)
    reproduction = reproduce(run, as_logged, estimator, prepared.search_cache, by_tree=by_tree)
    prepared = replace(
        prepared,
        reproduction=reproduction,
        claims=hypothetical or reproduction.same is not False,
        notes=(
            *_notes(evidence, choice, fitted, reproduction, hypothetical=hypothetical),
            *filter(None, [misses_note(evidence, contradicting)]),
        ),
    )
    return _with_worlds(prepared, types)


def _with_worlds(prepared: PreparedLog, types: tuple[ItemType, ...]) -> PreparedLog:
    """The log with worlds for the estimate, or with a note why it has none."""
    try:
        return replace(prepared, worlds=_sample_worlds(prepared, types))
    except NotAnswered as error:
        return replace(prepared, notes=(*prepared.notes, f"no estimate: {error}"))


def run_tree_of(prepared: PreparedLog, planner: Strategy) -> RunTree:
    """The tree of the strategy's runs over the log."""
    drove = prepared.driven.find(planner.name)
    if drove is not None and drove.is_of(prepared, planner):
        prepared.driven.drop(planner.name)
        return drove.tree
    evidence, built_in = prepared.evidence, canonical_name(planner.name)
    traits = search_traits(planner, evidence.task.goal)
    budget = prepared.settings.budget.of(plans_shortest=traits.plans_shortest)
    return RunTree(
        evidence,
        fast_strategy(planner, prepared.search_cache),
        prepared.estimator_of(planner),
        prepared.relevance_to(planner.relevant_types(evidence.task)),
        TreeOptions(
            seed=evidence.info.seed,
            merge=built_in is not None and not is_from_outside(planner),
            static_beliefs=prepared.static_beliefs,
            exact_beliefs=prepared.exact_beliefs_of(planner),
            reads_beliefs=uses_beliefs(planner, evidence.task.goal),
            looks_by=looks_by(planner, evidence.task.goal),
            parts=eq1_parts(planner),
            made_of=planner if isinstance(planner, Composed) else None,
            asked_again=budget.asked_again * budget.segments,
            traits=traits,
            durations=prepared.durations,
            as_driven=prepared.is_driven_again(planner),
        ),
    )


def run_by_tree(prepared: PreparedLog, tree: RunTree) -> tuple[Event, ...] | None:
    """The run of a tree's strategy over a plain log alone, by its first segment; None where it cannot tell."""
    evidence, durations = prepared.evidence, prepared.durations
    return _TOLD.of(tree).get("", lambda: plain_events(evidence, tree.advance(tree.root), durations=durations))


_TOLD: PerObject[str, tuple[Event, ...] | None] = PerObject(2)
"""By tree, what its first segment tells: the reproduction and the replay of the strategy that drove want the same."""


def _reproduced_by_tree(prepared: PreparedLog, planner: Strategy) -> tuple[Event, ...] | None:
    """The run of the strategy that drove over the log alone, by its tree, which is kept for its replay.

    None where the closed loop has to run it, or where the reproduction decides what the tree is.
    """
    if not prepared.is_plain or not prepared.exact_beliefs:
        return None
    tree = run_tree_of(prepared, planner)
    prepared.driven.put(planner.name, DrivenTree(planner=planner, estimator=prepared.estimator, tree=tree))
    return run_by_tree(prepared, tree)


def _notes(
    evidence: Evidence,
    choice: EstimatorChoice,
    durations: Durations | None,
    reproduction: Reproduction,
    *,
    hypothetical: bool,
) -> tuple[str, ...]:
    """What is to be known of all replays over a log."""
    words = tuple(filter(None, (*evidence.notes, choice.note, durations.words() if durations else "")))
    if reproduction.same is not False:
        return words
    if hypothetical:
        return (*words, f"with these beliefs {evidence.info.strategy} itself does not do what was recorded")
    return (*words, reproduction.why)


def _with_history(evidence: Evidence, settings: ReplaySettings) -> tuple[Evidence, bool]:
    """The evidence with the memory that a history makes at its start, and whether that is not the robot's own."""
    if not settings.histories:
        return evidence, False
    rates = settings.rates or shipped_rates()
    plan = evidence.place.plan
    memory = history_for(settings.histories, plan).memory_at(evidence.info.started.ns, plan, rates)
    own = evidence.memory is not None and evidence.memory.digest == memory.digest
    return (evidence, False) if own else (replace(evidence, memory=memory), True)


def drawer_of(estimator: Estimator, settings: ReplaySettings) -> Estimator:
    """By whose beliefs worlds are drawn."""
    from workbench.beliefs.estimators import estimator as estimator_named

    return estimator_named(settings.drawn_by, origin=NameOrigin.LOG) if settings.drawn_by else estimator


def _sample_worlds(prepared: PreparedLog, types: tuple[ItemType, ...]) -> SampledWorlds | None:
    """Worlds for the estimate, sampled from the belief given all that the log shows."""
    evidence, settings = prepared.evidence, prepared.settings
    if settings.worlds <= 0:
        return None
    return worlds_given(
        evidence,
        evidence.contents,
        prepared.relevance_to(types),
        drawer_of(prepared.estimator, settings),
        count=settings.worlds,
        seed=settings.seed,
    )


def _draws(evidence: Evidence, settings: ReplaySettings, estimator: Estimator) -> str:
    parts = (evidence.sha256, settings.seed, settings.worlds, estimator.name, settings.assumptions)
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
