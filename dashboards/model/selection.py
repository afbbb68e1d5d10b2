"""The strategy to drive next, from the replays stored in a folder, for the dashboard of that folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec

from replayers.batch.breakdown import fewest_misses
from replayers.batch.replays import Replays
from replayers.batch.store import replays_in
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.selection.campaign_logs import GroupBy, TrialGroup, trial_groups
from replayers.selection.verdict import SelectionSettings, SelectionVerdict, history


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderSelection:
    """The campaigns of a folder.

    Attributes:
        groups: trials that can be compared, each with what is known after every trial.
        left_out: what counts for nothing, with the reason, one line each.
        alpha: the error of eliminations by sequence.
    """

    groups: tuple[tuple[TrialGroup, tuple[SelectionVerdict, ...]], ...] = ()
    left_out: tuple[str, ...] = ()
    alpha: float = SelectionSettings().alpha


def selection_in(folder: Path) -> FolderSelection:
    """The selection from all replays that are kept in a folder, over the logs in it; nothing is replayed."""
    skipped: list[str] = []
    logs = {path.name: path for path in sorted(folder.rglob("*.mcap"), reverse=True)}
    found = [
        msgspec.structs.replace(record, log=str(logs[Path(record.log).name]))
        for record in replays_in(folder, on_skipped=lambda error: skipped.append(str(error)))
        if Path(record.log).name in logs
    ]
    kept = fewest_misses(found)  # a folder may keep the replays of several calls
    names = tuple(dict.fromkeys(record.strategy for record in kept))
    if len(names) < 2:
        return FolderSelection(left_out=tuple(skipped))
    made = Replays(outcomes=kept, logs=tuple(logs.values()), settings=ReplaySettings())
    grouped = trial_groups(made, names, GroupBy.SCENARIO)
    settings = SelectionSettings()
    return FolderSelection(
        groups=tuple((group, tuple(history(group.trials, settings))) for group in grouped.groups),
        left_out=(*grouped.left_out, *skipped),
        alpha=settings.alpha,
    )
