"""Replays of toy logs, as asked for and as kept."""

from __future__ import annotations

from pathlib import Path

from toy_logs import InOrder, toy_run

from replayers.batch.replay_all import ReplayRequest
from replayers.batch.store import StoredReplay, to_stored
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_strategy

NAMES = ("opt-greedy", "model-lios", "conditioned-lios")


def wanted(output: Path | None = None, **options: object) -> ReplayRequest:
    """Three strategies over few worlds."""
    return ReplayRequest(strategies=NAMES, settings=ReplaySettings(worlds=50), output=output, **options)  # type: ignore[arg-type]


def kept(planner: InOrder, folder: Path) -> StoredReplay:
    """A planner replayed over the hand-made run."""
    log = prepare_log(toy_run(folder), ReplaySettings(worlds=100))
    return to_stored(log, replay_strategy(log, planner), key="k")
