"""Replays as data frames: one with a row for each replay, one with a row for each step."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from replayers.batch.store import StepRow, StoredReplay
from workbench.third_party.data_frames import pd

_IDENTITY = ("log", "run_id", "place", "scenario", "recorded_strategy", "strategy", "estimator")


def replays_frame(records: Iterable[StoredReplay]) -> pd.DataFrame:
    """One row for each replay: identity, status, bounds with their proofs, estimate, support, seconds."""
    rows = []
    for r in records:
        row = {name: getattr(r, name) for name in (*_IDENTITY, "sha256", "place_sha256", "complete_log")}
        row |= {name: getattr(r, name) for name in ("status", "exact", "cost", "unseen", "true_cost", "true_status")}
        row |= {
            name: getattr(r, name) for name in ("searches", "seconds", "recorded_status", "recorded_cost", "reason")
        }
        row |= r.bounds.as_row() if r.bounds else {}
        if r.estimate:
            row |= {
                "estimate": r.estimate.mean,
                "estimate_ci95_low": r.estimate.ci95[0],
                "estimate_ci95_high": r.estimate.ci95[1],
                "interval90_low": r.estimate.interval90[0],
                "interval90_high": r.estimate.interval90[1],
                "interval90_mass": r.estimate.interval90_mass,
                "success": r.estimate.success,
            }
        row |= {f"steps_{support}": r.support.get(support, 0) for support in ("logged", "implied", "imputed")}
        rows.append(row)
    return pd.DataFrame(rows)


def steps_frame(records: Iterable[StoredReplay]) -> pd.DataFrame:
    """One row for each step of the run over the log alone."""
    rows = [
        {name: getattr(r, name) for name in _IDENTITY} | msgspec.structs.asdict(step) | {"items": list(step.items)}
        for r in records
        for step in r.steps
    ]
    return pd.DataFrame(rows, columns=None if rows else [*_IDENTITY, *StepRow.__struct_fields__])
