"""Selectors of the next strategy to drive: ours on intervals, and the baselines of the selection experiment.

- intervals: the least mean of expected costs (driven: the true cost; replayed: the estimate within its bounds), less
  an allowance for what the bounds leave open, which shrinks with the trials; all shrunk towards what the starts of
  the trials let expect (shrinkage.py); strategies out by proof are last.
- lower-bounds: replay with lower bounds only, as offline alt-policy replay does it: the greater of the mean lower
  bound over all trials and the UCB index of the driven ones (Paudel and Stein, arXiv:2304.01094, Sec. IV).
- ucb1: a bandit without replay (Auer, Cesa-Bianchi and Fischer, Machine Learning 47, 2002).
- thompson: a bandit without replay: a normal posterior of each mean, of which one value each is drawn.
- replays-alone, priors-alone: the two halves of intervals, to show what each of them gives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import log, sqrt
from types import MappingProxyType

import numpy as np

from replayers.selection.elimination import eliminated_by_proof
from replayers.selection.shrinkage import shrunk_means
from replayers.selection.trial_costs import TrialCosts
from workbench.arrays import Floats
from workbench.tolerances import RELATIVE

Selector = Callable[[Sequence[TrialCosts], Sequence[str], np.random.Generator], int]
"""Given the trials so far, each with the strategy that was driven, the index of the one to drive next."""

LOWER_BOUNDS_BONUS, UCB1_BONUS, THOMPSON_BONUS = 0.03, 0.4, 0.2
"""The baselines' exploration, in spreads of the driven costs: of 0.03, 0.1, 0.2, 0.4 and 1 the one with which each
had the least regret on training houses (the multi-room houses, deliver-3)."""

ALLOWANCE = 0.1
"""The share of the open part of the bounds that a strategy is given the benefit of."""


def by_intervals(trials: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    """The strategy of least expected cost, with an allowance for what is open; ties go to the first."""
    if not trials:
        return int(rng.integers(len(strategies)))
    out = {e.strategy for e in eliminated_by_proof(trials)}
    index = interval_index(trials)
    return min(range(len(strategies)), key=lambda k: (strategies[k] in out, round(float(index[k]), 9), k))


def interval_index(trials: Sequence[TrialCosts]) -> Floats:
    """Mean expected cost less the allowance for what the bounds leave open, shrunk; shape (K,)."""
    expected = np.array([t.expected for t in trials])
    below = expected - np.array([t.lower for t in trials])
    return shrunk_means(expected.mean(axis=0) - ALLOWANCE / sqrt(len(trials)) * below.mean(axis=0), trials)


def by_lower_bounds(trials: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    """Replay with lower bounds only: the greater of the mean lower bound and the UCB index, least over strategies."""
    if not trials:
        return int(rng.integers(len(strategies)))
    lower = np.mean([t.lower for t in trials], axis=0)
    index = np.maximum(lower, _ucb_index(trials, strategies, LOWER_BOUNDS_BONUS))
    return int(rng.choice(np.flatnonzero(index <= index.min() + RELATIVE)))


def by_ucb1(trials: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    """UCB1 on the driven costs alone."""
    index = _ucb_index(trials, strategies, UCB1_BONUS)
    return int(rng.choice(np.flatnonzero(index == index.min())))


def by_thompson(trials: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    """Thompson sampling on the driven costs alone."""
    driven = [_driven_costs(trials, name) for name in strategies]
    untried = [k for k, costs in enumerate(driven) if not costs]
    if untried:
        return int(rng.choice(untried))
    spread = _spread(trials, strategies)
    drawn = [float(rng.normal(np.mean(costs), THOMPSON_BONUS * spread / sqrt(len(costs)))) for costs in driven]
    return int(np.argmin(drawn))


def by_replays_alone(trials: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    """As intervals, without what was to be expected at the start of the trials."""
    return by_intervals([replace(t, prior=None) for t in trials], strategies, rng)


def by_priors_alone(trials: Sequence[TrialCosts], strategies: Sequence[str], rng: np.random.Generator) -> int:
    """The least mean of the trials' prior costs, whatever they then cost; ties go to the first."""
    means = [t.prior.mean for t in trials if t.prior is not None]
    if not means:
        return int(rng.integers(len(strategies)))
    return int(np.argmin(np.mean(means, axis=0).round(9)))


ABLATIONS: Mapping[str, Selector] = MappingProxyType(
    {"replays-alone": by_replays_alone, "priors-alone": by_priors_alone}
)
"""The two halves of intervals."""

SELECTORS: Mapping[str, Selector] = MappingProxyType(
    {"intervals": by_intervals, "lower-bounds": by_lower_bounds, "ucb1": by_ucb1, "thompson": by_thompson}
)


def _ucb_index(trials: Sequence[TrialCosts], strategies: Sequence[str], bonus: float) -> Floats:
    """Mean driven cost less its exploration bonus; minus infinity for what was never driven. Shape (K,).

    The bonus is in units of the spread of the driven costs, which is far less than the range that UCB1's proof takes:
    the baseline is the better for it.
    """
    spread = _spread(trials, strategies)
    found = np.full(len(strategies), -np.inf)
    for k, name in enumerate(strategies):
        costs = _driven_costs(trials, name)
        if costs:
            found[k] = np.mean(costs) - bonus * spread * sqrt(2 * log(len(trials)) / len(costs))
    return found


def _driven_costs(trials: Sequence[TrialCosts], name: str) -> list[float]:
    return [float(t.lower[t.strategies.index(name)]) for t in trials if t.driven == name]


def _spread(trials: Sequence[TrialCosts], strategies: Sequence[str]) -> float:
    """Standard deviation of all driven costs about their mean; the first cost itself where there is one only."""
    costs = [cost for name in strategies for cost in _driven_costs(trials, name)]
    return float(np.std(costs)) if len(costs) > 1 else (costs[0] if costs else 1.0)
