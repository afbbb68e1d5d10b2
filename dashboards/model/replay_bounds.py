"""Bounds and estimate of a replayed run's cost, as `lios replay` stores them beside its log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from replayers.counterfactual.estimates.intervals import finite
from workbench.errors import LiosError
from workbench.terminal import say


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayBounds:
    """Least and greatest cost over all consistent worlds; None where they were not proven.

    Attributes:
        estimate: mean over sampled worlds, with the interval that contains 90 % of them.
    """

    lower: float | None
    upper: float | None
    exact: bool
    estimate: float | None
    interval90: tuple[float, float] | None


def stored_bounds(log: Path) -> ReplayBounds | None:
    """The counterfactual stored beside a replay's log, None for another log; an unreadable file is reported."""
    kept_at = log.with_suffix(".json")
    if not log.name.endswith(".replay.mcap") or not kept_at.exists():
        return None
    from replayers.batch.store import read_replay

    try:
        kept = read_replay(kept_at)
    except LiosError as error:
        say(f"Bounds are not shown: {error}")
        return None
    return ReplayBounds(
        lower=kept.bounds.lower if kept.bounds is not None else None,
        upper=finite(kept.bounds.upper) if kept.bounds is not None else None,
        exact=kept.exact,
        estimate=kept.estimate.mean if kept.estimate is not None else None,
        interval90=kept.estimate.interval90 if kept.estimate is not None else None,
    )
