"""Prior costs: what each strategy costs in worlds drawn from the beliefs at a trial's start, before any look.

What a run found is one world of many that its place could have been. The start of its log (the place, the task, what
was known) and the beliefs at that time give others, in which every strategy is run: all in the same ones, by the same
closed loop. Nothing that the run found later counts, but for places that refused the robot.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import msgspec

from replayers.batch.replay_all import Outcome, strategies_named
from replayers.batch.replays import Replays
from replayers.batch.store import StoredReplay, replay_path, write_replay
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.world_failure import failure_in_worlds
from replayers.counterfactual.estimates.estimate import costs_in
from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds
from replayers.counterfactual.estimates.worlds_given import worlds_given
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, drawer_of, prepare_log
from replayers.counterfactual.relevance import relevance_of
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.sandbox import is_foreign
from replayers.runs.run import read
from workbench.beliefs.asking.answered_estimator import AnsweredEstimator
from workbench.errors import LiosError
from workbench.evaluation.cluster import run_in_order
from workbench.planning.actions import relevant_types
from workbench.plugins import NameOrigin
from workbench.remote.path import path_of

Costs = tuple[float, ...]


def prior_drawn(prepared: PreparedLog, strategies: Iterable[str]) -> Mapping[str, Costs]:
    """Each strategy's costs in the worlds drawn at the start, by the name that was given.

    A strategy that breaks in one of them has none. None has any where beliefs are asked for at a cost: runs in other
    worlds would ask for more of them than the log holds.
    """
    if isinstance(prepared.estimator, AnsweredEstimator) or prepared.settings.worlds <= 0 or not prepared.claims:
        return {}
    start = _at_start(prepared)
    worlds = _worlds_at_start(start)
    found: dict[str, Costs] = {}
    for name in strategies:
        try:
            costs = _costs_of(start, name, worlds)
        except LiosError:
            continue
        if costs:
            found[name] = costs
    return found


def with_priors(made: Replays, strategies: str, *, output: Path | None, workers: int = 1) -> Replays:
    """Replays with the prior costs of their strategies; those that are kept in a folder are kept there with them."""
    names = strategies_named(strategies, with_truth=made.settings.with_truth)
    names = tuple(name for name in names if name not in made.not_loaded)
    lacking = _lacking(made, names)
    units = ((log, tuple(of_log), made.settings) for log, of_log in lacking.items())
    at_once = 1 if made.settings.in_process else workers
    found = dict(zip(lacking, run_in_order(_priors_of_log, units, workers=at_once), strict=True))
    now: dict[tuple[str, str], StoredReplay] = {}
    for log, of_log in lacking.items():
        for name, before in of_log.items():
            if name in found[log]:
                now[log, before.strategy] = made_now = msgspec.structs.replace(before, prior_drawn=found[log][name])
                if output is not None and not is_foreign(name, origin=NameOrigin.USER):  # those always run again
                    misses = made.settings.assumptions.misses
                    write_replay(replay_path(output, made_now.sha256, made_now.run_id, name, misses=misses), made_now)
    return replace(made, outcomes=tuple(now.get((o.log, o.strategy), o) for o in made.outcomes))


def _lacking(made: Replays, names: tuple[str, ...]) -> Mapping[str, Mapping[str, StoredReplay]]:
    """Per log the replays without prior costs, by the name given of their strategy; what broke is not run again."""
    by_log: dict[str, list[Outcome]] = {}
    for outcome in made.outcomes:
        by_log.setdefault(outcome.log, []).append(outcome)
    found: dict[str, dict[str, StoredReplay]] = {}
    for log, outcomes in by_log.items():
        for name, o in zip(names, outcomes, strict=False):  # one only where a log cannot be read
            if isinstance(o, StoredReplay) and o.bounds is not None and not o.prior_drawn:
                found.setdefault(log, {})[name] = o
    return found


def _priors_of_log(unit: tuple[str, tuple[str, ...], ReplaySettings]) -> Mapping[str, Costs]:
    log, names, settings = unit
    try:
        return prior_drawn(prepare_log(read(path_of(log)), settings, with_paths=False), names)
    except LiosError:  # already reported by its replays
        return {}


def _at_start(prepared: PreparedLog) -> PreparedLog:
    """The log as if it ended at its start; tags are not seen, as in the estimate."""
    evidence = replace(
        prepared.evidence,
        contents=prepared.evidence.known,
        partly=MappingProxyType({}),
        refused_picks=MappingProxyType({}),
        left=frozenset(),
        walked=frozenset(),
        done=frozenset(),
        looks=MappingProxyType({}),
        corrections=(),
        seen_on_moves=MappingProxyType({}),
        tags=None,
        misses=0,
    )
    return replace(prepared, evidence=evidence, worlds=None, search_cache=SearchCache())


def _worlds_at_start(start: PreparedLog) -> SampledWorlds:
    evidence, settings = start.evidence, start.settings
    relevance = relevance_of(evidence, relevant_types(evidence.task.goal), settings.assumptions)
    drawer = drawer_of(start.estimator, settings)
    return worlds_given(evidence, evidence.known, relevance, drawer, count=settings.worlds, seed=settings.seed)


def _costs_of(start: PreparedLog, name: str, worlds: SampledWorlds) -> Costs:
    with start.planner(name, origin=NameOrigin.USER) as planner:
        tree = run_tree_of(start, planner)
        costs, _ = costs_in(worlds, tree, max_segments=start.settings.budget.draws)
        return () if failure_in_worlds(tree) is not None else tuple(float(c) for c in costs)
