"""Elimination of strategies: by proof on the trials so far, and by sequences that hold for coming trials.

Two kinds of elimination, which never mix:

- by proof: on the trials so far, the strategy cost more than another one in every world that agrees with their logs.
  It says that the strategy is not the best on these trials, and nothing of coming ones.
- by sequence: over trials like these, its mean cost is greater than another one's, with a probability of error of at
  most alpha over all pairs and all times (betting.py). From bounds alone it is judged by the least difference that
  the logs allow, so that what nobody saw never counts as evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from replayers.selection.betting import lower_limits
from replayers.selection.trial_costs import TrialCosts
from workbench.arrays import Floats
from workbench.tolerances import NEAR_COST

NEAR = NEAR_COST


@dataclass(frozen=True, slots=True, kw_only=True)
class Elimination:
    """A strategy that is ruled out, and by which other one.

    Attributes:
        strategy, by: the more expensive one and the cheaper one.
        proof: by proof on the trials so far; otherwise by sequence.
        margin: the least by which it cost more in total (proof), or costs more per trial on average (sequence).
    """

    strategy: str
    by: str
    proof: bool
    margin: float


def eliminated_by_proof(trials: Sequence[TrialCosts]) -> tuple[Elimination, ...]:
    """Every strategy that another one beat on the trials so far, in every world; by the one that beat it most."""
    names = trials[0].strategies
    least = -np.sum([t.max_difference for t in trials], axis=0).T  # of cost a minus cost b
    sums = np.sum([t.lower for t in trials], axis=0)[:, None] - np.sum([t.upper for t in trials], axis=0)[None, :]
    return _strongest(names, np.maximum(least, sums), proof=True)


def eliminated_by_sequence(trials: Sequence[TrialCosts], *, alpha: float = 0.05) -> tuple[Elimination, ...]:
    """Every strategy whose mean cost is greater than another one's, with an error of at most alpha over all pairs."""
    return _strongest(trials[0].strategies, min_mean_difference(trials, alpha=alpha), proof=False)


def min_mean_difference(trials: Sequence[TrialCosts], *, alpha: float = 0.05) -> Floats:
    """The least mean of cost a minus cost b over trials like these, with confidence; shape (K, K).

    Costs above a trial's failure cost count as that: whoever spends more than a failure costs has failed. The limits
    hold all together, at all times, with a probability of 1 - alpha: it is shared among the K (K - 1) pairs.
    """
    count = len(trials[0].strategies)
    limit = max(t.limit for t in trials)
    found = np.full((count, count), -limit)
    np.fill_diagonal(found, 0.0)
    for a in range(count):
        for b in range(count):
            if a != b:
                values = [min_difference(t, a, b) / limit for t in trials]
                found[a, b] = limit * lower_limits(values, alpha=alpha / (count * (count - 1)))[-1]
    return found


def min_difference(trial: TrialCosts, a: int, b: int) -> float:
    """The least cost of a minus cost of b on a trial, both counted up to the failure cost."""
    apart = max(-float(trial.max_difference[b, a]), float(trial.lower[a] - trial.upper[b]))
    if max(trial.upper[a], trial.upper[b]) > trial.limit + NEAR:
        # A difference bounded world by world may rest on costs above the limit: only the bounds can be cut there.
        apart = float(min(trial.lower[a], trial.limit) - min(trial.upper[b], trial.limit))
    return float(np.clip(apart, -trial.limit, trial.limit))


def _strongest(names: Sequence[str], least: Floats, *, proof: bool) -> tuple[Elimination, ...]:
    apart = least.copy()
    np.fill_diagonal(apart, -np.inf)
    found: list[Elimination] = []
    for a, name in enumerate(names):
        b = int(np.argmax(apart[a]))
        if apart[a, b] > NEAR:
            found.append(Elimination(strategy=name, by=names[b], proof=proof, margin=float(apart[a, b])))
    return tuple(found)
