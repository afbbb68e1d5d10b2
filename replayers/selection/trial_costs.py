"""The cost of every strategy on one trial: bounds, estimates, and the greatest difference of each pair."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Literal

import numpy as np

from replayers.batch.compare import cost_difference
from replayers.batch.store import StoredReplay
from workbench.arrays import Bools, Floats
from workbench.tolerances import NEAR_COST


@dataclass(frozen=True, slots=True, kw_only=True)
class PriorCosts:
    """What the strategies cost in worlds drawn at a trial's start, before any look.

    Attributes:
        mean: over the worlds, shape (K,).
        variance: over the worlds, of a strategy's cost less the mean of all strategies there; mean over strategies.
    """

    mean: Floats
    variance: float

    @classmethod
    def of(cls, costs: Floats) -> PriorCosts:
        """From the costs in the same worlds, shape (K, worlds)."""
        return cls(mean=costs.mean(axis=1), variance=float((costs - costs.mean(axis=0)).var(axis=1).mean()))


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialCosts:
    """One trial, and what its log shows about the strategies. Costs are charged costs, in metres and equivalents.

    Attributes:
        log: the log's path.
        strategies: the K names that the arrays follow.
        driven: which of them the robot followed; None where it followed another one.
        lower, upper: bounds over all worlds that agree with the log, shape (K,); 0 and infinite where nothing is
            known, as where the strategy broke.
        estimate: mean over drawn worlds, shape (K,); NaN where there is none.
        max_difference: the greatest cost of a minus the cost of b in one world, shape (K, K); infinite where unknown.
        limit: what a failed run is charged.
        drawn: costs in drawn worlds, the same ones for all, shape (K, worlds); None where a strategy has none.
        prior: costs in worlds drawn at the start of the trial; None where a strategy has none.
    """

    log: str
    strategies: tuple[str, ...]
    driven: str | None
    lower: Floats
    upper: Floats
    estimate: Floats
    max_difference: Floats
    limit: float
    drawn: Floats | None = None
    prior: PriorCosts | None = None

    def __post_init__(self) -> None:
        count = len(self.strategies)
        shapes = [self.lower.shape, self.upper.shape, self.estimate.shape]
        if shapes != [(count,)] * 3 or self.max_difference.shape != (count, count):
            raise ValueError(f"{self.log}: arrays do not fit {count} strategies")
        if np.any(self.lower > self.upper + NEAR_COST):
            raise ValueError(f"{self.log}: a lower bound above its upper one")

    @property
    def expected(self) -> Floats:
        """The estimate kept within the bounds; without one the middle of the bounds, or the failure cost where there
        is no upper one. Shape (K,)."""
        middle = np.where(np.isfinite(self.upper), (self.lower + np.minimum(self.upper, 1e12)) / 2, self.limit)
        return np.clip(np.where(np.isnan(self.estimate), middle, self.estimate), self.lower, self.upper)

    @property
    def exact(self) -> Bools:
        """Whose cost is certain, shape (K,)."""
        return self.upper - self.lower <= NEAR_COST


def trial_costs(replays: Iterable[StoredReplay], strategies: Sequence[str], *, limit: float) -> TrialCosts:
    """What the replays over one log show. A strategy without a replay, or that broke, is known to cost 0 or more.

    Args:
        replays: of one log, at least one.
        limit: what a failed run is charged.
    """
    found = {r.strategy: r for r in replays}
    first = next(iter(found.values()))
    count = len(strategies)
    lower, upper = np.zeros(count), np.full(count, inf)
    estimate, apart = np.full(count, nan), np.full((count, count), inf)
    np.fill_diagonal(apart, 0.0)
    for i, name in enumerate(strategies):
        made = found.get(name)
        if made is None or made.bounds is None:
            continue
        lower[i], upper[i] = made.bounds.lower, made.bounds.upper
        estimate[i] = made.estimate.mean if made.estimate else nan
        for j in range(i):
            other = found.get(strategies[j])
            if other is not None and other.bounds is not None:
                difference = cost_difference(made, other)
                apart[i, j], apart[j, i] = difference.most, -difference.least
    before = _same_worlds([found.get(name) for name in strategies], "prior_drawn")
    driven = next((r.recorded_strategy for r in found.values() if r.recorded_strategy in strategies), None)
    return TrialCosts(
        log=first.log,
        strategies=tuple(strategies),
        driven=driven,
        lower=lower,
        upper=upper,
        estimate=estimate,
        max_difference=apart,
        limit=limit,
        drawn=_same_worlds([found.get(name) for name in strategies], "drawn"),
        prior=None if before is None else PriorCosts.of(before),
    )


def _same_worlds(replays: Sequence[StoredReplay | None], which: Literal["drawn", "prior_drawn"]) -> Floats | None:
    """Costs in the worlds that all strategies were run in, shape (K, worlds); None where there are none."""
    made = [r for r in replays if r is not None]
    costs: list[tuple[float, ...]] = [getattr(r, which) for r in made]
    common = min((len(c) for c in costs), default=0)
    if len(made) < len(replays) or not common or len({r.draws for r in made}) > 1:
        return None
    return np.array([c[:common] for c in costs])
