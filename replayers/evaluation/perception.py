"""Calibration of detection probabilities from logs: Beta posteriors by detector, item type, container, range, angle.

Each trial is a Bernoulli draw; the prior is uniform, Beta(1, 1), so that n trials with d detections give
Beta(1 + d, 1 + n - d). The mean is what a site's file takes as p_detect.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, pi

from replayers.evaluation.detection_trials import DetectionTrial
from workbench.evaluation.distributions import beta_quantile

KINDS = ("made", "detector", "item", "container", "range", "angle")
"""What trials are grouped by: look or in passing, detector, type of the item, type of the container, range, angle."""
RANGES_M = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, inf)
ANGLES_DEG = (0, 30, 60, 90, 180)


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRate:
    """How surely items were detected in one group of trials.

    Attributes:
        by, group: what the trials share: one of KINDS, and which.
        trials, detected: how many, and in how many the item was detected.
        p_detect: posterior mean, in (0, 1).
        ci95: the equal-tailed 95 % interval of the posterior.
    """

    by: str
    group: str
    trials: int
    detected: int
    p_detect: float
    ci95: tuple[float, float]


def detection_rates(trials: Iterable[DetectionTrial]) -> tuple[DetectionRate, ...]:
    """The rate of each group that has trials, in the order of KINDS; empty without trials."""
    counts: dict[tuple[str, str], list[int]] = {}
    for trial in trials:
        for key in _groups(trial):
            counted = counts.setdefault(key, [0, 0])
            counted[0] += 1
            counted[1] += trial.detected
    ordered = sorted(counts, key=lambda key: (KINDS.index(key[0]), key[1]))
    return tuple(_rate(by, group, *counts[by, group]) for by, group in ordered)


def _rate(by: str, group: str, trials: int, detected: int) -> DetectionRate:
    a, b = 1.0 + detected, 1.0 + trials - detected
    return DetectionRate(
        by=by,
        group=group,
        trials=trials,
        detected=detected,
        p_detect=a / (a + b),
        ci95=(beta_quantile(0.025, a, b), beta_quantile(0.975, a, b)),
    )


def _groups(trial: DetectionTrial) -> Iterator[tuple[str, str]]:
    yield "made", trial.made
    yield "detector", trial.detector
    yield "item", trial.item_type
    yield "container", trial.container_type
    if trial.range_m is not None:
        yield "range", _range_of(trial.range_m)
    if trial.angle_rad is not None:
        yield "angle", _angle_of(trial.angle_rad * 180 / pi)


def _range_of(range_m: float) -> str:
    low, high = _around(range_m, RANGES_M)
    return f"{low:.1f} m and more" if high == inf else f"{low:.1f} to {high:.1f} m"


def _angle_of(angle_deg: float) -> str:
    low, high = _around(min(angle_deg, 179.0), ANGLES_DEG)
    return f"{low:.0f} to {high:.0f} degrees"


def _around(value: float, edges: Sequence[float]) -> tuple[float, float]:
    """The interval between two edges that contains a value, the lower edge included."""
    i = max(k for k, edge in enumerate(edges[:-1]) if value >= edge)
    return edges[i], edges[i + 1]
