"""Records a replay as a run like any other, with the log that it was made from as its origin.

The recording holds the run over the log alone; it ends as "undetermined" where the robot would have looked into a
container that nobody opened. On request, the run in a consistent world is recorded as well: the cheapest or the most
expensive that was found, or a sampled one. Every action carries its support: logged, implied or imputed.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from recorders.run_identity import run_id, written_here
from recorders.run_recorder import RunRecorder
from replayers.counterfactual.prepared_log import PreparedLog
from replayers.counterfactual.replay import Replay
from workbench.log_schema.asking_json import estimator_to_settings
from workbench.log_schema.events import RunInfo

IN_WORDS = {
    "": "over the log alone",
    "best": "in the cheapest world found",
    "worst": "in the most expensive world found",
    "drawn": "in a drawn world",
}


def write_replay_log(
    path: Path, prepared: PreparedLog, made: Replay, *, world: str = "", force: bool = False
) -> None:
    """Records a replay as MCAP.

    Args:
        world: "log" for the run over the log alone, or one of made.worlds.

    Raises:
        OutputExists: the file exists and force is not given.
    """
    evidence = prepared.evidence
    path.parent.mkdir(parents=True, exist_ok=True)
    with RunRecorder(
        path,
        info=replay_info(prepared, made, world),
        place=evidence.place,
        task=evidence.task,
        costs=evidence.costs,
        force=force,
        settings=estimator_to_settings(prepared.estimator),
    ) as recorder:
        for event in made.worlds[world] if world else made.events:
            recorder.record(event)


def replay_info(prepared: PreparedLog, made: Replay, world: str = "") -> RunInfo:
    """The identity of a replay: the run's, with another strategy and its origin."""
    info = prepared.evidence.info
    identity = (prepared.evidence.sha256, made.strategy, prepared.draws, *([world] if world else []))
    replayed = msgspec.structs.replace(
        info,
        run_id=run_id(" ".join(identity)),
        strategy=made.strategy,
        estimator=prepared.estimator.name,
        source="replay",
        origin_run=info.run_id,
        origin_sha256=prepared.evidence.sha256,
        title=f"{made.strategy} {IN_WORDS[world]} of {info.run_id}: {info.title}".strip(": "),
    )
    return written_here(replayed)
