"""Trials with costs worked out by hand, and trials drawn at random around hidden true costs."""

from __future__ import annotations

from math import inf

import numpy as np

from replayers.selection.trial_costs import Floats, TrialCosts

NAMES = ("a", "b", "c")


def trial(
    lower: list[float], upper: list[float], *, driven: str | None = "a", estimate: list[float] | None = None,
    max_difference: Floats | None = None, limit: float = 100.0,
) -> TrialCosts:  # fmt: skip
    """A trial of a, b and c; the greatest differences follow from the bounds unless given."""
    low, high = np.array(lower, dtype=float), np.array(upper, dtype=float)
    apart = high[:, None] - low[None, :]
    np.fill_diagonal(apart, 0.0)
    return TrialCosts(
        log="run.mcap",
        strategies=NAMES[: len(lower)],
        driven=driven,
        lower=low,
        upper=high,
        estimate=np.full(len(lower), np.nan) if estimate is None else np.array(estimate, dtype=float),
        max_difference=apart if max_difference is None else max_difference,
        limit=limit,
    )


def drawn_trial(rng: np.random.Generator) -> tuple[TrialCosts, Floats]:
    """A trial with random bounds around true costs, and these costs; some have no upper bound."""
    true = rng.uniform(10, 90, size=3)
    lower, upper = true - rng.exponential(8, size=3), true + rng.exponential(8, size=3)
    exact = rng.random(3) < 0.4
    lower, upper = np.where(exact, true, np.maximum(lower, 0)), np.where(exact, true, upper)
    upper[rng.random(3) < 0.05] = inf
    return trial(list(lower), list(upper), driven=NAMES[int(rng.integers(3))]), true
