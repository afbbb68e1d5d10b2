"""Quality figures of replay: shares and means over measured counterfactuals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite

import numpy as np

from replayers.evaluation.calibration import pit_distance, pit_histogram
from replayers.evaluation.trials import Counterfactual
from workbench.evaluation.statistics import mean_with_interval, resampled


def summary(found: Sequence[Counterfactual]) -> dict[str, object]:
    """The figures; shares are within [0, 1].

    Calibration is over the replays that are not exact (an exact one covers by itself), and has two sides:

    - interval_coverage_closed: how often the truth is in the printed interval, ends included. Costs are discrete, so
      that an interval which contains at least 90 % of the sampled worlds mostly contains more: the figure should
      equal interval_mass, the mean share that these intervals contain.
    - the probability integral transform, which discreteness does not bias
      (replayers.evaluation.calibration): pit, its histogram,
      uniform when calibrated; pit_distance, the largest distance of its distribution from the uniform one;
      interval_coverage, its share within the central 90 %, with an interval that resamples whole houses.
    """
    open_ended = [c for c in found if not c.exact]
    drawn = [c for c in open_ended if c.pit is not None]
    intervals = [c.pit for c in drawn if c.pit is not None]
    return {
        "counterfactuals": len(found),
        "inside_bounds": _share(c.inside for c in found),
        "exact": _share(c.exact for c in found),
        "exact_or_within_10_percent": _share(c.narrow for c in found),
        "interval_coverage": _mean(c.within for c in drawn if c.within is not None),
        "interval_coverage_ci95": _coverage_ci95(drawn),
        "interval_coverage_ci95_resamples": resampled(
            len(drawn), len({c.house for c in drawn}), "houses", "counterfactuals"
        ),
        "interval_coverage_closed": _share(c.covered for c in drawn),
        "interval_mass": _mean(c.mass for c in drawn if c.mass is not None),
        "pit": pit_histogram(intervals),
        "pit_distance": pit_distance(intervals),
        "not_exact": len(open_ended),
        "both_sides_reached": _share(c.lower_proof == c.upper_proof == "exact" for c in found),
        "upper_bounded": _share(isfinite(c.upper) for c in found),
        "complete_trees": _share(c.complete for c in found),
        "undetermined_alone": _share(c.status == "undetermined" for c in found),
        "estimate_bias": _mean((c.estimate or 0.0) - c.true_cost for c in open_ended if c.estimate is not None),
        "inside_if_beliefs_stand": _share(c.inside_if_beliefs_stand for c in found),
        "exact_if_beliefs_stand": _share(c.exact_if_beliefs_stand for c in found),
        "misses": _mean(float(c.misses) for c in found),
        "with_misses": _share(c.misses > 0 for c in found),
        "houses": len({c.house for c in found}),
        "tasks": len({(c.house, c.scenario, c.seed) for c in found}),
    }


def _coverage_ci95(drawn: Sequence[Counterfactual]) -> tuple[float, float] | None:
    """The 95 % interval of interval_coverage, over resamples of whole houses; within 0 and 1."""
    if not drawn:
        return None
    shares = [c.within if c.within is not None else 0.0 for c in drawn]
    ends = mean_with_interval(shares, [c.house for c in drawn], rng=np.random.default_rng(0)).interval
    lower, upper = (float(np.clip(end, 0.0, 1.0)) for end in ends)
    return (lower, upper)


def _share(values: Iterable[bool | None]) -> float | None:
    counted = [bool(v) for v in values]
    return sum(counted) / len(counted) if counted else None


def _mean(values: Iterable[float]) -> float | None:
    counted = list(values)
    return sum(counted) / len(counted) if counted else None
