"""Counterfactual replay: runs one strategy over one log, with bounds, an estimate and, on request, the true cost.

Runs go over the log alone (undetermined where it ends), in all consistent worlds, in sampled ones, and in the truth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from replayers.counterfactual.bounds.bounds import Bounds
from replayers.counterfactual.bounds.world_failure import failure_in_worlds
from replayers.counterfactual.bounds.world_search import WorldSearch, search_worlds
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log, run_tree_of
from replayers.counterfactual.results import Estimate
from replayers.counterfactual.run_tree import Leaf, RunTree
from replayers.counterfactual.sandbox import is_from_outside
from replayers.counterfactual.single_runs import (
    end_of,
    in_truth,
    over_log_alone,
    over_log_by_tree,
    run_in,
    support_of,
)
from replayers.counterfactual.strategy_traits import decision_kind
from replayers.runs.run import Run
from workbench.arrays import Floats
from workbench.errors import Unsupported
from workbench.execution.events import Event, RunEnded, RunStatus
from workbench.planning.strategies import needs_truth, resolved_name, strategy
from workbench.planning.strategy import Strategy
from workbench.plugins import NameOrigin
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ContainerId

__all__ = [
    "PreparedLog",
    "Replay",
    "ReplaySettings",
    "in_truth",
    "over_log_alone",
    "prepare_log",
    "replay",
    "replay_on",
    "replay_strategy",
    "run_tree_of",
]

WORLDS = ("best", "worst", "drawn")
"""Worlds in which a run can be recorded: the cheapest and the most expensive that were found, and a sampled one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """One strategy over one log.

    Attributes:
        status: how the run over the log alone ended; "undetermined" where it looks into what nobody opened;
            "planner-failed" where the strategy broke there or in any world that was followed; "not-reproduced" where
            the strategy that drove the run does not do here what was recorded (reproduction.py).
        reason, unseen: of that end.
        bounds: over all worlds that agree with the log; None where the strategy broke or the recorded one was not
            reproduced: its cost is then unknown.
        estimate: over drawn worlds; None if not asked for.
        support: steps of the run over the log alone, by what they rest on.
        seconds: predicted duration of the run over the log alone, by the log's own speeds.
        true_cost, true_status: in the recorded truth, where it was asked for.
        drawn: costs in the drawn worlds, for paired comparisons; shape (worlds,).
        events: of the run over the log alone: what is done and seen, and the end. All beliefs and decisions are there
            only where the log was prepared with paths.
        if_beliefs_stand: where beliefs follow all that is seen: the bounds if open containers held nothing but the
            task's types; where the log rounded them: the bounds of whoever believes the rounded ones; None where the
            bounds need no such condition.
        segments: how many segments of the loop were run for bounds and estimate.
        worlds: per kind of world that one can look at ("best", "worst", "drawn"), the events of the run in it.
        asked: open containers that it looks into in some world, as far as it was followed.
    """

    strategy: str
    status: RunStatus
    reason: str
    unseen: str | None
    bounds: Bounds | None
    estimate: Estimate | None
    support: Mapping[str, int]
    searches: int
    seconds: float
    true_cost: float | None
    true_status: str | None
    drawn: Floats | None
    events: tuple[Event, ...]
    if_beliefs_stand: Bounds | None = None
    segments: int = 0
    asked: tuple[ContainerId, ...] = ()
    worlds: Mapping[str, tuple[Event, ...]] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()

    @property
    def exact(self) -> bool:
        """Whether every world that is consistent with the log gives the same cost."""
        return self.bounds is not None and self.bounds.exact

    @property
    def cost(self) -> float | None:
        """The cost where it is certain: exact, or run in the recorded truth alone."""
        if self.status in (RunStatus.PLANNER_FAILED, RunStatus.NOT_REPRODUCED):
            return None
        if self.bounds is None:
            return self.true_cost
        return self.bounds.lower if self.bounds.exact else None


def replay(
    run: Run, strategy_name: str, settings: ReplaySettings | None = None, *, origin: NameOrigin = NameOrigin.LOG
) -> Replay:
    """Replays one strategy over one run. For many over one log, prepare it once: prepare_log, replay_on."""
    return replay_on(prepare_log(run, settings or ReplaySettings()), strategy_name, origin=origin)


def replay_on(
    prepared: PreparedLog, strategy_name: str, *, origin: NameOrigin = NameOrigin.LOG, worlds: Sequence[str] = ()
) -> Replay:
    """Replays one strategy over a prepared log.

    Args:
        origin: who gives the name; "module:Class" and solvers by command line are for users alone.
        worlds: of WORLDS, those in which the run is replayed from start to end.

    Raises:
        UnknownName: no such strategy.
        NotFromLog: a name that only a user may give.
        Unsupported: the oracle without the truth.
    """
    if not prepared.claims:
        return _not_reproduced(prepared, resolved_name(strategy_name))
    if needs_truth(strategy_name):
        return _in_truth_only(prepared, strategy_name, origin)
    with prepared.planner(strategy_name, origin=origin) as planner:
        return replay_strategy(prepared, planner, worlds=worlds)


def replay_strategy(prepared: PreparedLog, planner: Strategy, *, worlds: Sequence[str] = ()) -> Replay:
    """Replays a strategy over a prepared log."""
    if not prepared.claims:
        return _not_reproduced(prepared, planner.name)
    prepared = replace(prepared, estimator=prepared.estimator_of(planner))  # also where the strategy is wrapped
    evidence, own = prepared.evidence, run_tree_of(prepared, planner)
    alone = over_log_alone(prepared, planner) if prepared.with_paths else over_log_by_tree(prepared, own)
    ended = _undetermined_if_contradicted(end_of(alone), prepared)
    first = _first_unobserved_look(prepared, own.planner) or ended
    found = _world_search(prepared, planner, own, first)
    tree, bounds, drawn = found.tree, found.bounds, found.drawn
    true = end_of(in_truth(prepared, own.planner)) if prepared.truth is not None and not tree.guesses else None
    made = Replay(
        strategy=planner.name,
        status=ended.status,
        reason=ended.reason,
        unseen=ended.unseen,
        bounds=bounds,
        estimate=found.estimate,
        support=MappingProxyType(support_of(alone)),
        searches=ended.searches,
        seconds=(ended.stamp_ns - evidence.info.started.ns) / 1e9,
        true_cost=true.cost if true else None,
        true_status=true.status.value if true else None,
        drawn=drawn,
        events=alone,
        if_beliefs_stand=found.standing,
        segments=found.segments,
        asked=found.asked,
        worlds=MappingProxyType(dict(_events_in_worlds(worlds, prepared, tree, planner, bounds, drawn))),
        notes=(*prepared.notes, *_nondeterminism_note(tree, planner, first), *_outer_note(planner, bounds)),
    )
    if ended.status is RunStatus.PLANNER_FAILED:
        return _without_bounds(made, ended.reason)
    failure = failure_in_worlds(tree)
    return made if failure is None else _without_bounds(made, failure.message)


def _world_search(prepared: PreparedLog, planner: Strategy, tree: RunTree, first: RunEnded) -> WorldSearch:
    """The search of the worlds by a strategy, or by another that decides alike and went the same way at first.

    Args:
        tree, first: the strategy's own runs, and the end of its own up to the first open container.
    """

    def search() -> WorldSearch:
        budget = prepared.settings.budget.of(plans_shortest=tree.traits.plans_shortest)
        return search_worlds(tree, prepared.worlds, budget, prepared.search_cache)

    kind = decision_kind(planner, prepared.evidence.task.goal)
    if kind is None or is_from_outside(planner):
        return search()
    alike = (kind, prepared.exact_beliefs_of(planner), prepared.is_driven_again(planner))
    made = prepared.searched.get(alike, search)
    return made if _begins_as(made.tree, first) else search()


def _events_in_worlds(
    worlds: Sequence[str],
    prepared: PreparedLog,
    tree: RunTree,
    planner: Strategy,
    bounds: Bounds,
    drawn: Floats | None,
) -> Iterator[tuple[str, tuple[Event, ...]]]:
    """The run in the cheapest and the most expensive world that is known, and in the drawn world of median cost."""
    found: dict[str, Leaf | None] = {"best": bounds.cheapest, "worst": bounds.most_expensive}
    if "drawn" in worlds and drawn is not None and prepared.worlds is not None:
        middle = int(np.argsort(drawn, kind="stable")[len(drawn) // 2])
        found["drawn"] = tree.follow(prepared.worlds.chooser(middle))
    for name in worlds:
        leaf = found.get(name)
        if leaf is not None:
            yield name, tree.events(leaf, explained_by=planner)


def _first_unobserved_look(prepared: PreparedLog, planner: Strategy) -> RunEnded | None:
    """Where looks may have missed, or tags in passing count, how a run ends that stops at the first look that may
    have missed, and sees no tag."""
    if not prepared.evidence.misses and prepared.evidence.tags is None:
        return None
    again = prepared.is_driven_again(planner)
    return end_of(run_in(prepared, planner, LoggedWorld(prepared.evidence, with_paths=False, as_recorded=again)))


def _undetermined_if_contradicted(ended: RunEnded, prepared: PreparedLog) -> RunEnded:
    """The end of the run over the log alone: it shows nothing where what it rests on cannot be so."""
    if not prepared.contradicting or ended.status is RunStatus.PLANNER_FAILED:
        return ended
    named = ", ".join(prepared.contradicting)
    reason = f"the looks contradict the inventory, which lists {named}: at least one of them missed"
    return replace(ended, status=RunStatus.UNDETERMINED, reason=reason)


def _in_truth_only(prepared: PreparedLog, strategy_name: str, origin: NameOrigin) -> Replay:
    """A replay of a strategy that must see the truth: only where the log holds it and it may be used."""
    if prepared.truth is None:
        raise Unsupported(
            f"{strategy_name} knows the whole house, so a replay needs the recorded truth. Give --with-truth."
        )
    events = in_truth(prepared, strategy(strategy_name, origin=origin, house=prepared.truth))
    ended = end_of(events)
    return Replay(
        strategy=resolved_name(strategy_name),
        status=ended.status,
        reason=ended.reason,
        unseen=None,
        bounds=None,
        estimate=None,
        support=MappingProxyType(support_of(events)),
        searches=ended.searches,
        seconds=(ended.stamp_ns - prepared.evidence.info.started.ns) / 1e9,
        true_cost=ended.cost,
        true_status=ended.status.value,
        drawn=None,
        events=events,
        notes=prepared.notes,
    )


def _not_reproduced(prepared: PreparedLog, name: str) -> Replay:
    """Nothing but the reason: the recorded strategy itself does not do here what was recorded."""
    return Replay(
        strategy=name,
        status=RunStatus.NOT_REPRODUCED,
        reason=prepared.reproduction.why,
        unseen=None,
        bounds=None,
        estimate=None,
        support=MappingProxyType({}),
        searches=0,
        seconds=0.0,
        true_cost=None,
        true_status=None,
        drawn=None,
        events=(),
        notes=prepared.notes,
    )


def _without_bounds(made: Replay, why: str) -> Replay:
    """A replay of a strategy that broke in some world: neither bounds nor an estimate, but the reason."""
    return replace(
        made,
        status=RunStatus.PLANNER_FAILED,
        reason=why,
        bounds=None,
        estimate=None,
        drawn=None,
        if_beliefs_stand=None,
        worlds=MappingProxyType({}),
    )


def _begins_as(tree: RunTree, alone: RunEnded) -> bool:
    """Whether a tree's run goes, up to the first open container, where another run over the log went."""
    again = tree.advance(tree.root)
    unseen = again.unobserved.container if again.unobserved else None
    look = tree.evidence.costs.search if again.unobserved and again.unobserved.walk is None else 0.0
    return unseen == alone.unseen and abs(again.cost - look - alone.own_cost) <= NEAR_COST


def _nondeterminism_note(tree: RunTree, planner: Strategy, alone: RunEnded) -> tuple[str, ...]:
    """A note where the strategy, given the same view again, went elsewhere before the first open container."""
    if _begins_as(tree, alone):
        return ()
    return (f"{planner.name} is not deterministic: for the same view it decided otherwise; its bounds do not hold",)


def _outer_note(planner: Strategy, bounds: Bounds) -> tuple[str, ...]:
    """A note on why an end of the bounds is not reached in any world that is known."""
    why = "; ".join(reason.message for reason in bounds.why_outer)
    return (f"the bounds of {planner.name} are outer ones: {why}",) if why else ()
