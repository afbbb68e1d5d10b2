"""The verdict after each trial: which strategy to drive next, how certain that is, and the possible regret."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import ceil, inf, log

import numpy as np

from replayers.selection.betting import GRID, log_capitals
from replayers.selection.elimination import (
    NEAR,
    Elimination,
    Floats,
    eliminated_by_proof,
    eliminated_by_sequence,
    min_difference,
    min_mean_difference,
)
from replayers.selection.selectors import by_intervals
from replayers.selection.shrinkage import shrunk_means
from replayers.selection.trial_costs import TrialCosts

RESAMPLES = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionSettings:
    """How a selection is made.

    Attributes:
        alpha: the probability of a wrong elimination by sequence, over all pairs and times.
        horizon: how many trials there will be in all; None where that is open.
        seed: of the resampling.
    """

    alpha: float = 0.05
    horizon: int | None = None
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class StrategyStanding:
    """One strategy after some trials. Costs are means a trial.

    Attributes:
        lower, upper: bounds of its mean over the trials so far; upper is infinite where none is known.
        expected: its expected mean over the trials so far.
        to_come: its expected mean over coming trials like these (shrinkage.py).
        exact: on how many trials its cost is certain.
        chance_best: share of resampled trials and worlds in which it is the cheapest; None without drawn worlds.
        regret_so_far: by how much it may at most have cost more than another one, a trial, on the trials so far.
        middles: on how many trials `expected` is but the middle of its bounds, for want of drawn worlds (the failure
            cost where there is no upper bound).
    """

    strategy: str
    driven: int
    exact: int
    lower: float
    upper: float
    expected: float
    to_come: float
    chance_best: float | None
    regret_so_far: float
    middles: int


class Settled(StrEnum):
    """Whether more trials can change the answer.

    Attributes:
        BY_SEQUENCE: no, but for alpha, if they are like these.
        BY_PROOF: no, whatever the trials to the horizon bring, where every trial counts up to its failure cost and
            none to come has a greater one than those so far. A run that succeeds may cost more than a failure is
            charged, so that no cap holds for the costs themselves.
    """

    NO = ""
    BY_SEQUENCE = "by sequence"
    BY_PROOF = "by proof"


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionVerdict:
    """What is known after some trials.

    Attributes:
        trials: how many.
        next: the strategy to drive next.
        standings: every strategy.
        by_proof, by_sequence: eliminated strategies (elimination.py).
        same: strategies that cost the same as `next` on every trial so far, in every world.
        regret_so_far: by how much `next` may at most have cost more than another one, a trial, on the trials so far.
        regret_to_come: by how much it costs more at most in the mean of coming trials, with a probability of
            1 - alpha, where they are like these and failures count with their cost.
        regret_to_come_unknown: the greatest failure cost so far: a regret_to_come as great says nothing.
        settled: whether more trials can change the answer.
        trials_to_settle: about how many more trials like these settle it by sequence; None where that cannot be
            estimated.
    """

    trials: int
    next: str
    standings: tuple[StrategyStanding, ...]
    by_proof: tuple[Elimination, ...]
    by_sequence: tuple[Elimination, ...]
    same: tuple[str, ...]
    regret_so_far: float
    regret_to_come: float
    regret_to_come_unknown: float
    settled: Settled
    trials_to_settle: int | None


def verdict_after(trials: Sequence[TrialCosts], settings: SelectionSettings) -> SelectionVerdict:
    """What is known after these trials, of which there is at least one."""
    names = trials[0].strategies
    leader = by_intervals(trials, names, np.random.default_rng(settings.seed))
    most = np.sum([t.max_difference for t in trials], axis=0)
    same = tuple(n for k, n in enumerate(names) if k != leader and max(most[leader, k], most[k, leader]) <= NEAR)
    by_proof, by_sequence = eliminated_by_proof(trials), eliminated_by_sequence(trials, alpha=settings.alpha)
    rivals = [k for k, name in enumerate(names) if k != leader and name not in same]
    min_mean = min_mean_difference(trials, alpha=settings.alpha)
    return SelectionVerdict(
        trials=len(trials),
        next=names[leader],
        standings=_standings(trials, settings.seed),
        by_proof=by_proof,
        by_sequence=by_sequence,
        same=same,
        regret_so_far=max([0.0, *(float(most[leader, k]) / len(trials) for k in rivals)]),
        regret_to_come=max([0.0, *(-float(min_mean[k, leader]) for k in rivals)]),
        regret_to_come_unknown=max(t.limit for t in trials),
        settled=_settled(trials, leader, rivals, {e.strategy for e in by_sequence}, settings),
        trials_to_settle=_trials_to_settle(trials, leader, rivals, settings.alpha),
    )


def history(trials: Sequence[TrialCosts], settings: SelectionSettings) -> tuple[SelectionVerdict, ...]:
    """What was known after each trial."""
    return tuple(verdict_after(trials[: t + 1], settings) for t in range(len(trials)))


def _settled(
    trials: Sequence[TrialCosts], leader: int, rivals: Sequence[int], out: set[str], settings: SelectionSettings
) -> Settled:
    if settings.horizon is not None and len(trials) >= 1:
        left = max(0, settings.horizon - len(trials)) * max(t.limit for t in trials)
        leads = [sum(min_difference(t, k, leader) for t in trials) for k in rivals]
        if all(lead > left + NEAR for lead in leads):
            return Settled.BY_PROOF
    beaten = bool(rivals) and all(trials[0].strategies[k] in out for k in rivals)
    return Settled.BY_SEQUENCE if beaten else Settled.NO


def _trials_to_settle(trials: Sequence[TrialCosts], leader: int, rivals: Sequence[int], alpha: float) -> int | None:
    """From how the capitals against a mean difference of 0 have grown so far."""
    count, limit = len(trials[0].strategies), max(t.limit for t in trials)
    goal = log(count * (count - 1) / alpha) if count > 1 else 0.0
    zero = int(np.argmin(np.abs(GRID)))
    needed = 0.0
    for k in rivals:
        capital = log_capitals([min_difference(t, k, leader) / limit for t in trials])[:, zero]
        if capital.max() >= goal:
            continue
        grown = float(capital[-1]) / len(trials)
        needed = max(needed, (goal - float(capital[-1])) / grown if grown > 0 else inf)
    return ceil(needed) if needed < inf else None


def _standings(trials: Sequence[TrialCosts], seed: int) -> tuple[StrategyStanding, ...]:
    names = trials[0].strategies
    lower, upper = (np.mean([getattr(t, end) for t in trials], axis=0) for end in ("lower", "upper"))
    expected = np.mean([t.expected for t in trials], axis=0)
    to_come = shrunk_means(expected, trials)
    exact = np.sum([t.exact for t in trials], axis=0)
    chances = _chances(trials, np.random.default_rng(seed))
    driven = [sum(t.driven == name for t in trials) for name in names]
    regret = np.sum([t.max_difference for t in trials], axis=0).max(axis=1) / len(trials)  # 0 against itself
    middles = np.sum([np.isnan(t.estimate) & ~t.exact for t in trials], axis=0)
    return tuple(
        StrategyStanding(
            strategy=name,
            driven=driven[k],
            exact=int(exact[k]),
            lower=float(lower[k]),
            upper=float(upper[k]),
            expected=float(expected[k]),
            to_come=float(to_come[k]),
            chance_best=None if chances is None else float(chances[k]),
            regret_so_far=float(regret[k]),
            middles=int(middles[k]),
        )
        for k, name in enumerate(names)
    )


def _chances(trials: Sequence[TrialCosts], rng: np.random.Generator) -> Floats | None:
    """Share of resamples in which each strategy is the cheapest, shape (K,); ties share it. A resample draws trials
    with replacement (the only one, where there is one) and a drawn world of each."""
    tables = [t.drawn for t in trials if t.drawn is not None]
    if len(tables) < len(trials):
        return None
    chosen = rng.integers(len(tables), size=(RESAMPLES, len(tables)))
    totals = np.zeros((RESAMPLES, tables[0].shape[0]))
    for i, table in enumerate(tables):
        times = (chosen == i).sum(axis=1)
        for more in range(int(times.max(initial=0))):
            worlds = rng.integers(table.shape[1], size=RESAMPLES)
            totals += np.where(times > more, 1.0, 0.0)[:, None] * table[:, worlds].T
    best = totals <= totals.min(axis=1, keepdims=True) + NEAR
    return (best / best.sum(axis=1, keepdims=True)).mean(axis=0)
