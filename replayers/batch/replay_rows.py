"""Replays, and pairs of them over one log, as the rows that `lios replay --json` prints."""

from __future__ import annotations

from typing import Any

import msgspec

from replayers.batch.replay_all import LogFailed
from replayers.batch.store import StoredReplay
from replayers.counterfactual.estimates.intervals import finite


def replay_row(outcome: StoredReplay | LogFailed) -> dict[str, Any]:
    """One replay, or the reason why a log was not replayed."""
    if not isinstance(outcome, StoredReplay):
        return {
            "log": outcome.log,
            "strategy": outcome.strategy,
            "status": "not-replayed",
            "lower": None,
            "upper": None,
            "estimate": None,
            "exact": False,
            "reason": outcome.reason,
        }
    bounds, estimate, standing = outcome.bounds, outcome.estimate, outcome.if_beliefs_stand
    return {
        "log": outcome.log,
        "strategy": outcome.strategy,
        "status": outcome.status,
        "cost": outcome.cost,
        "lower": bounds.lower if bounds else None,
        "upper": finite(bounds.upper) if bounds else None,
        "estimate": estimate.mean if estimate else None,
        "exact": outcome.exact,
        "lower_proof": bounds.lower_proof if bounds else None,
        "upper_proof": bounds.upper_proof if bounds else None,
        "complete": bounds.complete if bounds else None,
        "steady_beliefs": outcome.steady_beliefs,
        "if_beliefs_stand": {"lower": standing.lower, "upper": finite(standing.upper)} if standing else None,
        "estimate_ci95": estimate.ci95 if estimate else None,
        "estimate_ci95_resamples": "drawn worlds" if estimate else None,
        "interval90": estimate.interval90 if estimate else None,
        "interval90_mass": estimate.interval90_mass if estimate else None,
        "success": estimate.success if estimate else None,
        "unseen": outcome.unseen,
        "true_cost": outcome.true_cost,
        "support": outcome.support,
        "searches": outcome.searches,
        "seconds": outcome.seconds,
        "seconds_rms": outcome.seconds_rms,
        "durations": msgspec.to_builtins(outcome.durations),
        "source": outcome.source,
        "recorded_strategy": outcome.recorded_strategy,
        "recorded_cost": outcome.recorded_cost,
        "reproduced": outcome.reproduced,
        "complete_log": outcome.complete_log,
        "lost": outcome.lost,
        "imputed": outcome.imputed,
        "misses": outcome.misses,
        "may_have_missed": outcome.may_have_missed,
        "contradicting": outcome.contradicting,
        "corrections": outcome.corrections,
        "reason": outcome.reason,
        "notes": outcome.notes,
    }


def pair_rows(outcomes: list[Any]) -> list[dict[str, Any]]:
    """Every pair of strategies over one log, in the same world."""
    by_log: dict[str, list[StoredReplay]] = {}
    for outcome in outcomes:
        if isinstance(outcome, StoredReplay) and outcome.bounds is not None:
            by_log.setdefault(outcome.sha256, []).append(outcome)
    several = [replays for replays in by_log.values() if len(replays) > 1]
    if not several:
        return []
    from replayers.batch.compare import cost_differences

    return [
        {
            "log": a.log,
            "a": a.strategy,
            "b": b.strategy,
            "verdict": apart.verdict,
            "difference_lower": finite(apart.least),
            "difference_upper": finite(apart.most),
            "chance_a_cheaper": apart.chance[0] if apart.chance else None,
            "chance_equal": apart.chance[1] if apart.chance else None,
        }
        for replays in several
        for a, b, apart in cost_differences(replays)
    ]
